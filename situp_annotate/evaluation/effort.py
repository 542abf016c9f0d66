"""A simulated annotator: how many boxes a person has to draw until a track is right.

The person draws the object's first box, looks at what is made of it, corrects one frame, and
looks again, until enough frames are right. Their boxes are the truth's (or near it); where the
object is absent, they say so.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from situp_annotate.errors import SitupError
from situp_annotate.evaluation.contenders import Contender
from situp_annotate.evaluation.datasets import OtbTarget
from situp_annotate.evaluation.picks import Pick, Situation, written_boxes
from situp_annotate.evaluation.prefixes import PrefixCache
from situp_annotate.propagation import Footage, FramesInMemory, PassCache, Survey, propagate
from situp_annotate.propagation.camera import CameraMotion
from situp_annotate.propagation.fusion import overlaps as overlaps_of
from situp_annotate.types import BoundingBox, Frame, Keyframe, Track

__all__ = [
    "BUDGETS",
    "GOAL",
    "MOST_BOXES",
    "THRESHOLDS",
    "Observer",
    "Simulation",
    "Subject",
    "prepare",
    "simulate",
]

Array = npt.NDArray[np.float64]

THRESHOLDS = (0.7, 0.5)
"""Overlaps from which a box counts as right."""

BUDGETS = (1, 2, 3, 5, 10)
"""Boxes drawn at which recall is told."""

GOAL = 0.95
"""Share of all frames that have to be right, those included that the person drew."""

MOST_BOXES = 250
"""Boxes after which the person gives up."""


@dataclass(frozen=True, slots=True)
class Subject:
    """A target to annotate, its pictures and what is true of it.

    Attributes
    ----------
    name : str
        The target's.
    footage : Footage
        Of n frames.
    survey : Survey
        Of the footage.
    truth : ndarray
        (n, 4): x, y, width, height in pixels, counted from 0; NaN where the object is absent.
    """

    name: str
    footage: Footage
    survey: Survey
    truth: Array

    @property
    def present(self) -> npt.NDArray[np.bool_]:
        """Whether the object is there, (n,)."""
        return ~np.isnan(self.truth[:, 0])


Observer = Callable[[Situation], None]
"""Called after each propagation."""


@dataclass(frozen=True, slots=True)
class Simulation:
    """How the annotation of a target went.

    Attributes
    ----------
    frames : int
        Of the target.
    boxes_drawn : mapping of float to int
        For each threshold, boxes drawn when the goal was reached; else when the person gave up.
    reached : mapping of float to bool
        For each threshold, whether the goal was reached.
    recalls : mapping of float to tuple of float
        For each threshold, the share of right boxes among the frames that the person did not
        draw, with 1, 2, 3 … boxes drawn; 1 if there are no such frames.
    """

    frames: int
    boxes_drawn: Mapping[float, int]
    reached: Mapping[float, bool]
    recalls: Mapping[float, tuple[float, ...]]

    @property
    def recall_by_budget(self) -> dict[float, dict[int, float]]:
        """For each threshold and budget, the recall with as many boxes.

        If the last goal was reached with fewer, the recall with those.
        """
        return {
            threshold: {budget: recalls[min(budget, len(recalls)) - 1] for budget in BUDGETS}
            for threshold, recalls in self.recalls.items()
        }


def prepare(target: OtbTarget, frames: Iterable[Frame]) -> Subject:
    """Take in a target and its pictures, as far as both go.

    Raises
    ------
    SitupError
        If the object is absent throughout.
    """
    kept = [frame for frame, _ in zip(frames, target.truth, strict=False)]
    truth = target.truth[: len(kept)] - (1, 1, 0, 0)
    truth[~(np.isfinite(truth).all(axis=1) & (truth[:, 2:] > 0).all(axis=1))] = np.nan
    if np.isnan(truth[:, 0]).all():
        raise SitupError(f"{target.name}: the truth has no box in any frame, so none can be drawn.")
    camera = CameraMotion()
    survey = Survey(np.array([camera(frame.image) for frame in kept]))
    return Subject(target.name, FramesInMemory(kept), survey, truth)


def simulate(
    subject: Subject,
    contender: Contender,
    pick: Pick,
    *,
    hand: Array | None = None,
    most_boxes: int = MOST_BOXES,
    cache: PassCache | None = None,
    observe: Observer | None = None,
) -> Simulation:
    """Annotate a target, box by box, until the goal is reached at every threshold.

    Parameters
    ----------
    subject : Subject
        The target.
    contender : Contender
        How boxes are propagated.
    pick : Pick
        Which frame is corrected next.
    hand : ndarray, optional
        (n, 4), what the person draws if asked; the truth itself by default.
    most_boxes : int
        After how many boxes they give up; at least 1.
    cache : PassCache, optional
        Passes of the same subject and tracker, such as those of another simulation.
    observe : Observer, optional
        Called after each propagation, the last one included.
    """
    hand = subject.truth if hand is None else hand
    cache = PrefixCache() if cache is None else cache
    most_boxes = min(most_boxes, contender.most_boxes or most_boxes, len(subject.truth))
    frames = [int(subject.present.argmax())]
    recalls: dict[float, list[float]] = {threshold: [] for threshold in THRESHOLDS}
    boxes_drawn: dict[float, int] = {}
    while True:
        situation = _look(subject, contender, _keyframes(hand, sorted(frames)), cache)
        if observe is not None:
            observe(situation)
        for threshold in THRESHOLDS:
            right = situation.overlaps >= threshold
            others = right[situation.open_frames]
            recalls[threshold].append(float(others.mean()) if len(others) else 1.0)
            if right.mean() >= GOAL:
                boxes_drawn.setdefault(threshold, len(frames))
        if len(boxes_drawn) == len(THRESHOLDS) or len(frames) == most_boxes:
            break
        frames.append(pick(situation))
    return Simulation(
        frames=len(subject.truth),
        boxes_drawn={each: boxes_drawn.get(each, len(frames)) for each in THRESHOLDS},
        reached={each: each in boxes_drawn for each in THRESHOLDS},
        recalls={each: tuple(recalls[each]) for each in THRESHOLDS},
    )


def _keyframes(hand: Array, frames: Sequence[int]) -> tuple[Keyframe, ...]:
    """What the person draws in these frames: their box, or that the object is outside."""
    return tuple(
        Keyframe(frame, BoundingBox(*map(float, hand[frame])))
        if np.isfinite(hand[frame]).all()
        else Keyframe(frame, None)
        for frame in frames
    )


def _look(
    subject: Subject, contender: Contender, keyframes: tuple[Keyframe, ...], cache: PassCache
) -> Situation:
    """Propagate, and compare with the truth."""
    labels = propagate(
        subject.footage,
        [Track(1, subject.name, keyframes)],
        contender.options,
        tracker=contender.tracker,
        cache=cache,
        survey=subject.survey,
    ).tracks[0]
    boxes = written_boxes(labels, len(subject.truth))
    there = np.isfinite(boxes).all(axis=1)
    overlaps = (~subject.present & ~there).astype(float)
    both = subject.present & there
    overlaps[both] = overlaps_of(boxes[both], subject.truth[both])
    overlaps[[keyframe.frame for keyframe in keyframes]] = 1.0
    return Situation(keyframes, labels, overlaps, subject.footage.size_hw)
