"""Whether keyframes that came back from another tool still say what a run had found."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from situp_annotate.formats.labelled import LabelledTrack, LabelledVideo
from situp_annotate.propagation.fusion import overlaps
from situp_annotate.types import BoundingBox, Keyframe, State

__all__ = ["Found"]

_Edges: TypeAlias = npt.NDArray[np.float64]
"""(…, 4): left, top, right, bottom in pixels; NaN without a box."""

_SAME = 0.02
"""Pixels by which an edge may be off and still be the same: formats round to a hundredth."""

_SLACK = 0.9
"""Share of the overlap that is asked for: other tools interpolate a little differently."""


def _edges(box: BoundingBox) -> tuple[float, float, float, float]:
    return box.x, box.y, box.right, box.bottom


def _sized(edges: _Edges) -> npt.NDArray[np.float64]:
    """From (n, 4) edges to x, y, width, height."""
    return np.hstack([edges[:, :2], edges[:, 2:] - edges[:, :2]])


@dataclass(frozen=True, slots=True)
class Found:
    """What a run had found of a track, frame by frame.

    Attributes
    ----------
    edges : ndarray
        (frames, 4): of each label, lost ones too; NaN in frames without.
    present : ndarray
        (frames,): where a label is exported to every format: the object is not lost, and its box
        lies in the picture, at least in part.
    lost : ndarray
        (frames,): where the object is lost.
    hidden : ndarray
        (frames,): where the object is not in view.
    size_wh : tuple of int
        Of the picture.
    iou : float
        How well exported keyframes stand for the labels between them, at least.
    """

    edges: _Edges
    present: npt.NDArray[np.bool_]
    lost: npt.NDArray[np.bool_]
    hidden: npt.NDArray[np.bool_]
    size_wh: tuple[int, int]
    iou: float

    @classmethod
    def of(cls, labelled: LabelledTrack, video: LabelledVideo, iou: float) -> "Found":
        """What a run had found of a track of a video."""
        size_wh = (video.info.width, video.info.height)
        edges = np.full((video.frame_count, 4), np.nan)
        present, lost, hidden = (np.zeros(video.frame_count, bool) for _ in range(3))
        for frame, point in labelled.points.items():
            edges[frame] = _edges(point.box)
            lost[frame] = point.state is State.LOST
            present[frame] = not lost[frame] and point.box.intersects(*size_wh)
            hidden[frame] = point.state is not State.VISIBLE
        return cls(edges, present, lost, hidden, size_wh, iou)

    def _clipped(self, edges: _Edges) -> _Edges:
        return np.clip(edges, 0, [*self.size_wh, *self.size_wh])

    def _same_boxes(self, frames: npt.NDArray[np.intp], edges: _Edges) -> npt.NDArray[np.bool_]:
        """Whether boxes are the run's, or as much of them as lies in the picture."""
        theirs = self.edges[frames]
        differences = (np.abs(edges - theirs), np.abs(edges - self._clipped(theirs)))
        # NaN is not at most anything.
        whole, clipped = (np.all(each <= _SAME, axis=1) for each in differences)
        return np.asarray(whole | clipped)

    def boxes_in_common(self, keyframes: Sequence[Keyframe]) -> int:
        """How many boxes are where the run had put them."""
        boxes = [
            (keyframe.frame, _edges(keyframe.box))
            for keyframe in keyframes
            if keyframe.box and keyframe.frame < len(self.edges)
        ]
        if not boxes:
            return 0
        frames = np.array([frame for frame, _ in boxes])
        return int(self._same_boxes(frames, np.array([edges for _, edges in boxes])).sum())

    def has(self, keyframe: Keyframe) -> bool:
        """Whether the run said the same of this frame."""
        frame = keyframe.frame
        if frame >= len(self.edges):
            return False
        if keyframe.box is None:
            return not self.present[frame]
        agrees = not self.present[frame] or keyframe.occluded == self.hidden[frame]
        return bool(agrees) and self.boxes_in_common([keyframe]) == 1

    def starts_before(self, keyframes: Sequence[Keyframe]) -> bool:
        """Whether the run had labels before the first of the keyframes."""
        return bool(keyframes) and bool(self.present[: keyframes[0].frame].any())

    def agrees_between(self, before: Keyframe, after: Keyframe | None) -> bool:
        """Whether two keyframes stand for what the run had found between them.

        Parameters
        ----------
        before : Keyframe
            Holds until the next one; its box moves evenly to that of `after`, if that has one.
        after : Keyframe or None
            None for the end of the video.
        """
        stop = len(self.edges) if after is None else min(after.frame, len(self.edges))
        frames = np.arange(before.frame + 1, stop)
        present = self.present[frames]
        if before.box is None:
            return not present.any()
        # Boxes of lost objects are exported on demand, and then each stretch has its keyframes.
        unexpected = np.isnan(self.edges[frames, 0]) | (
            self.lost[frames] != self.lost[before.frame]
        )
        changed = present & (self.hidden[frames] != before.occluded)
        if (unexpected | changed).any():
            return False
        start = np.array([_edges(before.box)])
        if after is None or after.box is None:
            boxes = start.repeat(len(frames), axis=0)
        else:
            shares = (frames - before.frame)[:, None] / (after.frame - before.frame)
            boxes = start + (np.array([_edges(after.box)]) - start) * shares
        theirs = self.edges[frames]
        whole = overlaps(_sized(boxes), _sized(theirs))
        with np.errstate(invalid="ignore"):  # nothing is left of boxes outside the picture
            clipped = overlaps(*(_sized(self._clipped(edges)) for edges in (boxes, theirs)))
        return bool((np.fmax(whole, clipped) >= _SLACK * self.iou).all())
