"""Figures over all targets of the simulated annotator, as JSON data."""

import math
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import numpy.typing as npt

from situp_annotate.evaluation.calibration import Calibration, calibration
from situp_annotate.evaluation.effort import Simulation
from situp_annotate.evaluation.effort_study import MethodResult, TargetResult
from situp_annotate.evaluation.fitting import predict_left_out, sequence_of
from situp_annotate.evaluation.samples import Samples
from situp_annotate.propagation.confidence import GOOD

__all__ = ["REPORTED", "bars", "effort_document", "geometric_mean_of_boxes"]

REPORTED = 0.7
"""Overlap from which boxes are right, in the bars."""

_BUDGET = 3
_PERFECT = 0.999
_RESAMPLES = 2000
_INTERVAL = (2.5, 97.5)

Ratio = Callable[[Sequence[TargetResult]], float]


def _boxes(target: TargetResult, method: str, run: str = "worst") -> int:
    return target.methods[method].runs[run].boxes_drawn[REPORTED]


def _recall(target: TargetResult, method: str) -> float:
    return target.methods[method].runs["worst"].recall_by_budget[REPORTED][_BUDGET]


def geometric_mean_of_boxes(
    targets: Sequence[TargetResult], method: str, run: str = "worst"
) -> float:
    """Geometric mean over the targets of the boxes drawn for the goal at an overlap of 0.7."""
    return statistics.geometric_mean(_boxes(target, method, run) for target in targets)


def _ratios(methods: Sequence[str]) -> dict[str, Ratio]:
    """Bars that are ratios of boxes, as far as their methods were simulated."""

    def ratio(run: str, base: str) -> Ratio:
        return lambda targets: (
            geometric_mean_of_boxes(targets, "both", run) / geometric_mean_of_boxes(targets, base)
        )

    named = {
        "boxes_vs_linear": ("worst", "linear"),
        "boxes_vs_forward": ("worst", "forward"),
        "suggested_boxes_vs_linear": ("suggested", "linear"),
    }
    return {
        name: ratio(run, base)
        for name, (run, base) in named.items()
        if {"both", base} <= set(methods)
    }


def _interval(targets: Sequence[TargetResult], ratio: Ratio) -> list[float]:
    """95 % of what the ratio is when the targets are drawn again, with replacement."""
    rng = np.random.default_rng(0)
    drawn = rng.integers(len(targets), size=(_RESAMPLES, len(targets)))
    values = [ratio([targets[index] for index in row]) for row in drawn]
    return [float(bound) for bound in np.percentile(values, _INTERVAL)]


def _wins(target: TargetResult, baselines: Sequence[str]) -> bool:
    """Whether ``both`` finds more than every baseline, or all that there is."""
    ours, best = _recall(target, "both"), max(_recall(target, each) for each in baselines)
    return ours > best or (ours == best and ours >= _PERFECT)


def _against_baselines(targets: Sequence[TargetResult]) -> dict[str, float]:
    methods = set(targets[0].methods)
    baselines = sorted(methods - {"both"})
    found: dict[str, float] = {}
    if "both" not in methods:
        return found
    if {"linear", "forward"} <= methods:
        found["worst_excess_boxes"] = max(
            _boxes(t, "both") - min(_boxes(t, "linear"), _boxes(t, "forward")) for t in targets
        )
    if baselines:
        found["recall3_wins"] = statistics.fmean(_wins(t, baselines) for t in targets)
    if "linear" in methods:
        found["recall3_gain_over_linear"] = 100 * statistics.mean(
            _recall(t, "both") - _recall(t, "linear") for t in targets
        )
    return found


def _confidence(samples: Samples) -> dict[str, float]:
    if len({sequence_of(target) for target in samples.target}) < 2:
        return {}
    confidence = predict_left_out(samples, GOOD)

    def judge(chosen: npt.NDArray[np.bool_]) -> Calibration:
        return calibration(confidence[chosen], samples.overlap[chosen])

    suggested = samples.pick == "suggested"
    auroc, ece, _ = judge(suggested)
    share = judge(suggested & (samples.boxes >= _BUDGET)).share
    return {
        "confidence_auroc": auroc,
        "confidence_ece": ece,
        "failures_in_least_confident_tenth": share,
    }


def _quality(targets: Sequence[TargetResult]) -> dict[str, float]:
    tracks = [m.quality for t in targets for m in t.methods.values() if m.quality is not None]
    if not tracks:
        return {}
    return {
        "thin_iou": statistics.mean(track.thin_iou for track in tracks),
        "thin_keyframes_per_100": statistics.mean(t.thin_keyframes_per_100 for t in tracks),
        "largest_step_at_keyframes": statistics.mean(track.large_steps for track in tracks),
    }


def bars(targets: Sequence[TargetResult], samples: Samples) -> dict[str, float]:
    """The figures that sum up ``both``, as far as the methods that they need were simulated.

    Parameters
    ----------
    targets : sequence of TargetResult
        At least one; all with the same methods.
    samples : Samples
        Of these targets.

    Returns
    -------
    dict of str to float
        All at an overlap of 0.7, with the truth's own boxes and the worst frame corrected, unless
        said otherwise.

        ``boxes_vs_linear``, ``boxes_vs_forward``
            Boxes drawn ÷ those that the other method needs; geometric mean over the targets.
            Where the person gave up, what they had drawn by then counts.
        ``suggested_boxes_vs_linear``
            The same with suggested frames corrected, ÷ linear interpolation's worst frames.
        ``worst_excess_boxes``
            Boxes more than the better of both needs, on the target where that is most.
        ``recall3_wins``
            Share of targets on which recall with 3 boxes is higher than every other method's. An
            exact tie counts if the recall is at least 0.999.
        ``recall3_gain_over_linear``
            Mean difference of recall with 3 boxes in points of 100.
        ``confidence_auroc``, ``confidence_ece``, ``failures_in_least_confident_tenth``
            See :class:`~situp_annotate.evaluation.calibration.Calibration`: of boxes in frames
            that nobody drew, with suggested frames corrected, by coefficients that were fitted
            without the box's own sequence. The share of failures is that with 3 boxes or more:
            with fewer, far more than a tenth of all boxes fail.
        ``thin_iou``, ``thin_keyframes_per_100``, ``largest_step_at_keyframes``
            Means over the targets of the figures of
            :class:`~situp_annotate.evaluation.track_quality.TrackQuality`.
    """
    ratios = {name: ratio(targets) for name, ratio in _ratios([*targets[0].methods]).items()}
    found = ratios | _against_baselines(targets) | _confidence(samples) | _quality(targets)
    return {name: value for name, value in found.items() if math.isfinite(value)}


def _run_document(run: Simulation) -> dict[str, Any]:
    recalls = run.recall_by_budget
    return {
        str(threshold): {
            "boxes": boxes,
            "reached": run.reached[threshold],
            "boxes_per_100_frames": 100 * boxes / run.frames,
            "recall_by_budget": {str(k): value for k, value in recalls[threshold].items()},
        }
        for threshold, boxes in run.boxes_drawn.items()
    }


def _method_document(result: MethodResult) -> dict[str, Any]:
    runs = {name: _run_document(run) for name, run in result.runs.items()}
    return {"runs": runs, "track": None if result.quality is None else asdict(result.quality)}


def effort_document(
    targets: Sequence[TargetResult], samples: Samples, settings: Mapping[str, Any]
) -> dict[str, Any]:
    """Everything as plain JSON data: settings, bars with bootstrap intervals, targets."""
    ratios = _ratios([*targets[0].methods])
    return {
        "settings": dict(settings),
        "bars": bars(targets, samples),
        "intervals_95": {name: _interval(targets, ratio) for name, ratio in ratios.items()},
        "targets": {
            target.name: {
                "frames": target.frames,
                "methods": {n: _method_document(result) for n, result in target.methods.items()},
            }
            for target in targets
        },
    }
