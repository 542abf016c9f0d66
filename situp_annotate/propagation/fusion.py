"""Join the pass from the keyframe before with the pass from the keyframe after.

Which pass is right is a hidden state of each frame: both, the forward one, the backward one, or
neither. The likeliest sequence of states is found for the whole stretch at once, from how well
the passes agree, how high their responses peak, how they meet the human boxes at the far ends,
and how far the box would have to jump. Where both are right they are cross-faded, where one is
right it is taken, where neither is the gap is bridged.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from situp_annotate.propagation.passes import Pass, peak_evidence

__all__ = ["Fused", "Trust", "center_boxes", "corner_boxes", "fuse", "overlaps"]

Array = npt.NDArray[np.float64]

_EVIDENCE_PER_OVERLAP = 14.0
_USUAL_OVERLAP = 0.5
_MOST_EVIDENCE = 6.0
_WEIGHT = 0.6
_SWITCH = 0.01
_NEITHER = 0.3
_JUMP = 6.0
_LONGEST_JUMP = 3.0
_RAMPS = 8


class Trust(IntEnum):
    """Which passes are taken to be right in a frame."""

    BOTH = 0
    FORWARD = 1
    BACKWARD = 2
    NEITHER = 3


_FORWARD_RIGHT = np.array([True, True, False, False])
_BACKWARD_RIGHT = np.array([True, False, True, False])


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
    """Intersection over union, row by row, of boxes (n, 4) as x, y, width, height."""
    corner = np.maximum(boxes[:, :2], others[:, :2])
    opposite = np.minimum(boxes[:, :2] + boxes[:, 2:], others[:, :2] + others[:, 2:])
    shared = np.prod(np.clip(opposite - corner, 0, None), axis=1)
    both = np.prod(boxes[:, 2:], axis=1) + np.prod(others[:, 2:], axis=1)
    ratio: Array = shared / (both - shared)
    return ratio


def center_boxes(boxes: Array) -> Array:
    """From (n, 4) x, y, width, height to centre x, centre y, log width, log height."""
    return np.hstack([boxes[:, :2] + boxes[:, 2:] / 2, np.log(boxes[:, 2:])])


def corner_boxes(centered: Array) -> Array:
    """Inverse of :func:`center_boxes`."""
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
    ahead, behind = center_boxes(forward.boxes), center_boxes(backward.boxes)
    trust = _likeliest(forward, backward, agreement, ahead, behind)
    share = np.linspace(0, 1, len(trust))[:, np.newaxis]
    sources = ((1 - share) * ahead + share * behind, ahead, behind, np.full_like(ahead, np.nan))
    path = np.choose(trust[:, np.newaxis], sources)
    path = _bridged(path, _scene(path, shifts))
    path = _without_jumps(path, np.flatnonzero(np.diff(trust)))
    boxes = corner_boxes(path)
    boxes[0], boxes[-1] = forward.boxes[0], backward.boxes[-1]
    return Fused(boxes, trust, agreement)


def _likeliest(
    forward: Pass, backward: Pass, agreement: Array, ahead: Array, behind: Array
) -> npt.NDArray[np.int64]:
    """The likeliest sequence of :class:`Trust`, by Viterbi's algorithm."""
    evidence = _evidence(forward, backward, agreement)
    stay, switch = np.log(1 - _SWITCH), np.log(_SWITCH)
    changed = (_FORWARD_RIGHT[:, np.newaxis] != _FORWARD_RIGHT).astype(int) + (
        _BACKWARD_RIGHT[:, np.newaxis] != _BACKWARD_RIGHT
    )
    transitions = np.repeat([(2 - changed) * stay + changed * switch], len(evidence), axis=0)
    transitions[1:, Trust.FORWARD, Trust.BACKWARD] -= _jump_cost(ahead[:-1], behind[1:])
    transitions[1:, Trust.BACKWARD, Trust.FORWARD] -= _jump_cost(behind[:-1], ahead[1:])
    best = evidence[0]
    origins = np.zeros(evidence.shape, np.int64)
    for row in range(1, len(evidence)):
        scores = best[:, np.newaxis] + transitions[row]
        origins[row] = scores.argmax(axis=0)
        best = scores.max(axis=0) + evidence[row]
    trust = np.empty(len(evidence), np.int64)
    trust[-1] = best.argmax()
    for row in range(len(evidence) - 1, 0, -1):
        trust[row - 1] = origins[row, trust[row]]
    return trust


def _evidence(forward: Pass, backward: Pass, agreement: Array) -> Array:
    """Log-likelihood of each trust in each frame, (n, 4), up to a constant of the frame."""
    forward_right = np.where(_FORWARD_RIGHT, 0.5, -0.5) * peak_evidence(forward.peak)[:, np.newaxis]
    backward_right = (
        np.where(_BACKWARD_RIGHT, 0.5, -0.5) * peak_evidence(backward.peak)[:, np.newaxis]
    )
    same = _EVIDENCE_PER_OVERLAP * (agreement - _USUAL_OVERLAP)
    bounded = _WEIGHT * np.clip(same, -_MOST_EVIDENCE, _MOST_EVIDENCE)
    # At the ends one of the passes is the human box, and the other is right if it agrees.
    bounded[[0, -1]] = same[[0, -1]]
    both_right = np.array([0.5, -0.5, -0.5, -0.5]) * bounded[:, np.newaxis]
    evidence: Array = forward_right + backward_right + both_right
    evidence[:, Trust.NEITHER] -= _NEITHER
    evidence[0, ~_FORWARD_RIGHT] = evidence[-1, ~_BACKWARD_RIGHT] = -np.inf
    return evidence


def _jump_cost(path: Array, other: Array) -> Array:
    """What it costs to change from one path to another at each frame: the way in target sizes."""
    size = np.exp((path[:, 2:].sum(axis=1) + other[:, 2:].sum(axis=1)) / 4)
    apart = np.hypot(*(path[:, :2] - other[:, :2]).T) / size
    apart += np.abs(path[:, 2:] - other[:, 2:]).sum(axis=1)
    cost: Array = _JUMP * np.minimum(apart, _LONGEST_JUMP)
    return cost


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
