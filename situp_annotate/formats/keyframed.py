"""The fewest keyframes that stand for the labels of a track, for tools that interpolate."""

from collections.abc import Collection
from itertools import pairwise

from situp_annotate.formats.labelled import LabelledTrack
from situp_annotate.propagation.thinning import thin
from situp_annotate.types import BoundingBox, Keyframe, Provenance, State, TrackPoint

__all__ = ["keyframes_of"]


def _changes(points: dict[int, TrackPoint]) -> set[int]:
    """Frames from which on the object is hidden, or seen again."""
    return {
        after
        for before, after in pairwise(points)
        if (points[before].state is State.VISIBLE) != (points[after].state is State.VISIBLE)
    }


def keyframes_of(
    track: LabelledTrack,
    *,
    frame_count: int,
    iou: float,
    states: Collection[State],
    decimals: int,
    keep: Collection[int] = (),
) -> tuple[Keyframe, ...]:
    """Keyframes between which straight lines give the labels back.

    Parameters
    ----------
    track : LabelledTrack
        The labels.
    frame_count : int
        Frames of the video.
    iou : float
        In (0, 1]: what an interpolated box overlaps the label in its place by, at least, as
        intersection over union, in spite of rounding.
    states : collection of State
        Labels in other states count as none.
    decimals : int
        To which the reader's tool rounds coordinates.
    keep : collection of int
        Further frames whose labels stay keyframes; those without a label do not count.

    Returns
    -------
    tuple of Keyframe
        In order of frames, the boxes that a person drew among them, with a box that is hidden
        or not at every change of that, and ``outside`` (no box) wherever labels end before the
        video does. Empty if there is no label.
    """
    points = track.in_states(states)
    if not points:
        return ()
    boxes: dict[int, BoundingBox] = {frame: point.box for frame, point in points.items()}
    human = {frame for frame, point in points.items() if point.provenance is Provenance.HUMAN}
    wanted = human | _changes(points) | points.keys() & set(keep)
    kept = thin(boxes, iou=iou, keep=wanted, rounding=0.5 * 10**-decimals)
    keyframes = []
    for frame, box in kept.items():
        keyframes.append(Keyframe(frame, box, points[frame].state is not State.VISIBLE))
        if frame + 1 not in boxes and frame + 1 < frame_count:
            keyframes.append(Keyframe(frame + 1, None))
    return tuple(keyframes)
