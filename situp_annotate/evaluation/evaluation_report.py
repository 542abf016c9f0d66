"""What an evaluation came to, as plain data, with the protocol that it was made by."""

import platform
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import cv2
import numpy as np

import situp_annotate
from situp_annotate.evaluation.benchmark import Target, attribute_groups, set_groups
from situp_annotate.evaluation.metrics import (
    NORMALIZED_THRESHOLDS,
    PRECISION_PIXELS,
    PRECISION_THRESHOLDS,
    THRESHOLDS,
)
from situp_annotate.evaluation.otb_frames import first_picture
from situp_annotate.evaluation.robustness import SEGMENTS
from situp_annotate.evaluation.scores import Scores, mean_scores

__all__ = ["Evaluation", "TrackerResult", "evaluation_document"]

_PROTOCOL: Mapping[str, Any] = {
    "success": {
        "overlap": "intersection over union of boxes with inclusive edges (right = x + w − 1)",
        "counts_if": "overlap > threshold",
        "thresholds": [round(float(value), 2) for value in THRESHOLDS],
        "auc": "mean of the shares at all thresholds",
    },
    "precision": {
        "error": "distance of the centres in pixels, a centre being x + (w − 1) / 2",
        "counts_if": "error <= threshold",
        "thresholds": PRECISION_THRESHOLDS.tolist(),
        "figure": f"share at {PRECISION_PIXELS} px",
    },
    "normalized_precision": {
        "error": "distance of the centres in widths and heights of the true box",
        "counts_if": "error <= threshold",
        "thresholds": [round(float(value), 2) for value in NORMALIZED_THRESHOLDS],
        "figure": "mean of the shares at all thresholds",
    },
    "first_frame": "counts, with the truth as its result",
    "no_box": "a result that is not finite or has no area repeats the one before",
    "absent": "a frame whose truth has a number that is not positive, counted from 1, is a miss "
    "in success and a hit in both precisions, as in the OTB toolkit",
    "means": "over targets, each of the same weight; of tre and sre, all frames of a target's runs "
    "count together",
    "ope": "one run from the first frame, begun with its true box",
    "tre": f"up to {SEGMENTS} runs to the end from frames spread over the sequence",
    "sre": "12 runs from the first frame, begun with its true box shifted (8) or scaled (4)",
    "speed": "frames per second of init and update, without decoding; geometric mean over targets",
}


@dataclass(frozen=True, slots=True)
class TrackerResult:
    """One tracker.

    Attributes
    ----------
    name : str
        Of the tracker.
    source : str
        ``"run here"``, or where its boxes were read from.
    scores : dict of str to dict of str to Scores
        By protocol and target.
    speeds : dict of str to float
        Frames per second by target; empty where boxes were read.
    """

    name: str
    source: str
    scores: Mapping[str, Mapping[str, Scores]]
    speeds: Mapping[str, float] = field(default_factory=dict)

    @property
    def speed(self) -> float | None:
        """Geometric mean of frames per second."""
        return statistics.geometric_mean(self.speeds.values()) if self.speeds else None

    def mean(self, protocol: str, names: Sequence[str]) -> Scores | None:
        """Mean over those of the named targets that there are boxes of; None without any."""
        scores = self.scores.get(protocol, {})
        present = [scores[name] for name in names if name in scores]
        return mean_scores(present) if present else None


@dataclass(frozen=True, slots=True)
class Evaluation:
    """All trackers on all targets."""

    targets: Sequence[Target]
    trackers: Sequence[TrackerResult]
    protocols: Sequence[str]

    @property
    def names(self) -> list[str]:
        """Of all targets."""
        return [target.name for target in self.targets]

    def of_protocol(self, protocol: str) -> list[TrackerResult]:
        """The trackers that were measured by a protocol."""
        return [tracker for tracker in self.trackers if tracker.scores.get(protocol)]

    def common(self, protocol: str) -> list[str]:
        """Targets that every tracker of a protocol has boxes of."""
        every = [tracker.scores[protocol] for tracker in self.of_protocol(protocol)]
        return [name for name in self.names if all(name in scores for scores in every)]

    def sets(self, protocol: str) -> dict[str, list[str]]:
        """All targets; where some tracker lacks some, those that all have; the named sets."""
        groups = {"all": self.names}
        common = self.common(protocol)
        if 0 < len(common) < len(self.names):
            groups["common"] = common
        return groups | set_groups(self.targets)


def evaluation_document(evaluation: Evaluation) -> dict[str, Any]:
    """Everything as plain JSON data."""
    return {
        "versions": {
            "situp-annotate": situp_annotate.__version__,
            "python": platform.python_version(),
            "numpy": np.__version__,
            "opencv": cv2.__version__,
        },
        "protocol": dict(_PROTOCOL),
        "targets": {target.name: _target(target) for target in evaluation.targets},
        "trackers": {
            tracker.name: {
                "source": tracker.source,
                "frames_per_second": tracker.speed,
                "frames_per_second_by_target": dict(tracker.speeds),
                **{each: _scores(evaluation, tracker, each) for each in tracker.scores},
            }
            for tracker in evaluation.trackers
        },
    }


def _target(target: Target) -> dict[str, Any]:
    return {
        "frames": len(target.truth),
        "absent_frames": int((~(target.truth > 0).all(axis=1)).sum()),
        "first_picture": first_picture(target.sequence) or 1,
        "attributes": list(target.attributes),
        "sets": list(target.sets),
    }


def _scores(evaluation: Evaluation, tracker: TrackerResult, protocol: str) -> dict[str, Any]:
    def means(groups: Mapping[str, Sequence[str]]) -> dict[str, Any]:
        return {
            group: {
                "targets": sum(name in tracker.scores[protocol] for name in names),
                **_figures(scores),
            }
            for group, names in groups.items()
            if (scores := tracker.mean(protocol, names)) is not None
        }

    return {
        "sets": means(evaluation.sets(protocol)),
        "attributes": means(attribute_groups(evaluation.targets)),
        "targets": {name: _figures(each) for name, each in tracker.scores[protocol].items()},
    }


def _figures(scores: Scores) -> dict[str, Any]:
    return {
        "auc": scores.auc,
        "precision": scores.precision,
        "normalized_precision": scores.normalized_precision,
        **asdict(scores),
    }
