"""What a finished track is like: how well it can be thinned, and whether it jumps."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from situp_annotate.evaluation.picks import Situation, written_boxes
from situp_annotate.propagation.thinning import overlaps, thin
from situp_annotate.types import BoundingBox

__all__ = ["TrackQuality", "judge_track"]

Array = npt.NDArray[np.float64]

_RARE = 99.0


@dataclass(frozen=True, slots=True)
class TrackQuality:
    """Figures of a dense track.

    Attributes
    ----------
    thin_iou : float
        Mean overlap of the track with the interpolation between the keyframes that thinning keeps.
    thin_keyframes_per_100 : float
        Keyframes kept, those of the person among them, per hundred boxes.
    large_steps : float
        Share of human keyframes and junctions at which the track makes a step, of its centre or
        of its size, that is larger than 99 % of all its steps. A junction is where boxes begin to
        come about in another way than in the frame before.
    """

    thin_iou: float
    thin_keyframes_per_100: float
    large_steps: float


def judge_track(situation: Situation) -> TrackQuality:
    """Judge the track of a situation."""
    boxes = written_boxes(situation.labels, len(situation.overlaps))
    track = {
        int(frame): BoundingBox(*map(float, boxes[frame]))
        for frame in np.flatnonzero(np.isfinite(boxes).all(axis=1))
    }
    human = [k.frame for k in situation.keyframes if k.box is not None and k.frame in track]
    kept = thin(track, keep=human)
    return TrackQuality(
        thin_iou=float(overlaps(track, kept).mean()),
        thin_keyframes_per_100=100 * len(kept) / len(track),
        large_steps=_large_steps(boxes, sorted({*human, *_junctions(situation)})),
    )


def _junctions(situation: Situation) -> list[int]:
    """Frames before which the kind of evidence changes inside a stretch."""
    return [
        stretch.start + int(row) + 1
        for stretch in situation.labels.stretches
        for row in np.flatnonzero(np.diff(stretch.evidence.kind))
    ]


def _large_steps(boxes: Array, places: list[int]) -> float:
    """Share of the frames `places` with a rare step from the frame before or to the next."""
    centers = boxes[:, :2] + boxes[:, 2:] / 2
    sizes = np.log(boxes[:, 2:]).sum(axis=1) / 2
    measures = (np.hypot(*np.diff(centers, axis=0).T), np.abs(np.diff(sizes)))
    rare = np.zeros(len(boxes) + 1, bool)  # at i: the step from frame i - 1 to i
    for steps in measures:
        known = steps[np.isfinite(steps)]
        if len(known):
            rare[1:-1] |= steps > np.percentile(known, _RARE)
    at = np.array(places)
    return float((rare[at] | rare[at + 1]).mean())
