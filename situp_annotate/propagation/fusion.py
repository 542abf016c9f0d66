"""Join the pass from the keyframe before with the pass from the keyframe after.

Where both are trusted they are cross-faded, so that each meets its human box; where one is
trusted it is taken; where neither is, the gap is bridged.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from situp_annotate.propagation.passes import Pass
from situp_annotate.propagation.trust import Trust, likeliest_trust

__all__ = ["Fused", "bridge", "fuse", "overlaps"]

Array = npt.NDArray[np.float64]

_RAMPS = 8


@dataclass(frozen=True, slots=True)
class Fused:
    """The fusion of a stretch, in the order of time; its ends are the human boxes.

    Attributes
    ----------
    boxes : ndarray
        (n, 4): x, y, width, height in pixels.
    trust : ndarray of int
        (n,), :class:`Trust` of each frame.
    agreement : ndarray
        (n,), overlap of both passes, in [0, 1].
    """

    boxes: Array
    trust: npt.NDArray[np.int64]
    agreement: Array


def overlaps(boxes: Array, others: Array) -> Array:
    """Intersection over union, row by row.

    Parameters
    ----------
    boxes, others : ndarray
        (n, 4): x, y, width, height, of the same origin.

    Returns
    -------
    ndarray
        (n,), in [0, 1]; NaN where a number is NaN.
    """
    corner = np.maximum(boxes[:, :2], others[:, :2])
    opposite = np.minimum(boxes[:, :2] + boxes[:, 2:], others[:, :2] + others[:, 2:])
    shared = np.prod(np.clip(opposite - corner, 0, None), axis=1)
    both = np.prod(boxes[:, 2:], axis=1) + np.prod(others[:, 2:], axis=1)
    ratio: Array = shared / (both - shared)
    return ratio


def _centered(boxes: Array) -> Array:
    """From (n, 4) x, y, width, height to centre x, centre y, log width, log height."""
    return np.hstack([boxes[:, :2] + boxes[:, 2:] / 2, np.log(boxes[:, 2:])])


def _cornered(centered: Array) -> Array:
    """Inverse of :func:`_centered`."""
    size = np.exp(centered[:, 2:])
    return np.hstack([centered[:, :2] - size / 2, size])


def fuse(forward: Pass, backward: Pass, shifts: Array) -> Fused:
    """Join two passes over the same stretch.

    Parameters
    ----------
    forward : Pass
        From the keyframe before; n ≥ 2 rows in the order of time.
    backward : Pass
        From the keyframe after, in the order of time too; as many rows.
    shifts : ndarray
        (n, 2), how far the scene moved in x and y since the frame before; row 0 is not used.
    """
    agreement = overlaps(forward.boxes, backward.boxes)
    ahead, behind = _centered(forward.boxes), _centered(backward.boxes)
    share = np.linspace(0, 1, len(ahead))[:, np.newaxis]
    paths = np.stack([(1 - share) * ahead + share * behind, ahead, behind], axis=1)
    trust = likeliest_trust(forward, backward, agreement, paths)
    path = np.where(
        (trust == Trust.NEITHER)[:, np.newaxis],
        np.nan,
        paths[np.arange(len(trust)), np.minimum(trust, Trust.BACKWARD)],
    )
    path = _bridged(path, _scene(path, shifts))
    path = _without_jumps(path, np.flatnonzero(np.diff(trust)))
    boxes = _cornered(path)
    boxes[0], boxes[-1] = forward.boxes[0], backward.boxes[-1]
    return Fused(boxes, trust, agreement)


def bridge(first: Array, last: Array, shifts: Array) -> Array:
    """Boxes (n, 4) from the first to the last, (4,) each, without looking at the picture.

    They go straight in the picture, or in the scene if the object has moved less there.

    Parameters
    ----------
    first, last : ndarray
        (4,): x, y, width, height in pixels.
    shifts : ndarray
        (n, 2), as for :func:`fuse`.
    """
    ends = np.stack([first, last])
    path = np.full((len(shifts), 4), np.nan)
    path[[0, -1]] = _centered(ends)
    moved, scene = path[-1, :2] - path[0, :2], np.cumsum(shifts, axis=0) - shifts[0]
    with_scene = np.hypot(*(moved - scene[-1])) < np.hypot(*moved)
    boxes = _cornered(_bridged(path, scene if with_scene else np.zeros_like(scene)))
    boxes[[0, -1]] = ends
    return boxes


def _scene(path: Array, shifts: Array) -> Array:
    """Where the scene took its points, (n, 2), if that makes the path smoother; else zeros."""
    scene: Array = np.cumsum(shifts, axis=0) - shifts[0]
    still = np.zeros_like(scene)

    def roughness(motion: Array) -> float:
        bends = np.diff(path[:, :2] - motion, 2, axis=0)
        return float(np.nansum(np.abs(bends)))

    return scene if roughness(scene) < roughness(still) else still


def _bridged(path: Array, scene: Array) -> Array:
    """Fill rows of NaN by straight lines, in the picture or in the scene."""
    missing = np.isnan(path[:, 0])
    if not missing.any():
        return path
    rows = np.arange(len(path))
    bridged = path.copy()
    bridged[:, :2] -= scene
    for column in bridged.T:
        column[missing] = np.interp(rows[missing], rows[~missing], column[~missing])
    bridged[:, :2] += scene
    return bridged


def _without_jumps(path: Array, junctions: npt.NDArray[np.int64]) -> Array:
    """Spread the jump between each of these rows and the next over the frames around.

    No further than needed for steps that the path has elsewhere, and never over the ends.
    """
    smooth = path.copy()
    steps = np.abs(np.diff(path, axis=0))
    usual = np.delete(steps, junctions, axis=0)
    if len(usual) == 0:
        return smooth
    largest, typical = usual.max(axis=0), np.median(usual, axis=0)
    room = np.maximum(largest - typical, 1e-3 * np.maximum(largest, 1e-6))
    for row in junctions:
        jump = path[row + 1] - path[row]
        jump -= np.clip(jump, -typical, typical)
        needed = int(np.max(np.ceil(np.abs(jump) / room))) // 2 + 1
        ramp = min(needed, max(1, len(path) // _RAMPS))
        left, right = min(ramp, row), max(min(ramp, len(path) - 3 - row), 0)
        if left + right == 0:
            continue
        part = left / (left + right)
        rising, falling = np.arange(1, left + 1) / left, np.arange(right, 0, -1) / right
        smooth[row - left + 1 : row + 1] += np.outer(rising, part * jump)
        smooth[row + 1 : row + 1 + right] -= np.outer(falling, (1 - part) * jump)
    return smooth
