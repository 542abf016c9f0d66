"""Which frame a person corrects next."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from situp_annotate.propagation import TrackLabels, suggest
from situp_annotate.types import Keyframe, State

__all__ = ["PICKS", "Pick", "Situation", "pick_suggested", "pick_worst", "written_boxes"]

Array = npt.NDArray[np.float64]


class Situation(NamedTuple):
    """What the person sees, and what they do not: how good it is.

    Attributes
    ----------
    keyframes : tuple of Keyframe
        What they drew so far, in order of frames.
    labels : TrackLabels
        What is made of it.
    overlaps : ndarray
        (n,), of each frame's box with the truth, in [0, 1]; 1 for keyframes, and where the object
        is absent and no box is there; 0 where a box is missing or too many.
    size_hw : tuple of int
        Height and width of the pictures in pixels.
    """

    keyframes: tuple[Keyframe, ...]
    labels: TrackLabels
    overlaps: Array
    size_hw: tuple[int, int]

    @property
    def open_frames(self) -> npt.NDArray[np.int64]:
        """Frames that are not keyframes, in order."""
        drawn = [keyframe.frame for keyframe in self.keyframes]
        return np.setdiff1d(np.arange(len(self.overlaps)), drawn)


Pick = Callable[[Situation], int]
"""Chooses the frame to correct next, one that is no keyframe; there is one at least."""


def written_boxes(labels: TrackLabels, frame_count: int) -> Array:
    """Boxes that are written to files, (frame_count, 4); NaN where there is none or it is lost."""
    boxes = np.full((frame_count, 4), np.nan)
    for stretch in labels.stretches:
        seen = np.array([state is not State.LOST for state in stretch.states])
        boxes[stretch.start : stretch.stop][seen] = stretch.boxes[seen]
    return boxes


def pick_worst(situation: Situation) -> int:
    """The frame with the least overlap, the first of equals: someone looks through all frames."""
    frames = situation.open_frames
    return int(frames[situation.overlaps[frames].argmin()])


def pick_suggested(situation: Situation) -> int:
    """The frame that is suggested for review.

    Where nothing is suggested, the one with the least confidence; where there are no boxes to go
    by, the one furthest from what was drawn.
    """
    frames = situation.open_frames
    for suggestion in suggest(situation.labels, situation.size_hw, most=1):
        if suggestion.frame in frames:
            return suggestion.frame
    confidence = np.full(len(situation.overlaps), np.nan)
    for stretch in situation.labels.stretches:
        confidence[stretch.start : stretch.stop] = stretch.confidence
    if np.isfinite(confidence[frames]).any():
        return int(frames[np.nanargmin(confidence[frames])])
    drawn = np.array([keyframe.frame for keyframe in situation.keyframes])
    apart = np.abs(frames[:, np.newaxis] - drawn).min(axis=1)
    return int(frames[apart.argmax()])


PICKS: Mapping[str, Pick] = {"worst": pick_worst, "suggested": pick_suggested}
"""By name."""
