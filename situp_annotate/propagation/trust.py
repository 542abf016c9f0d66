"""Which of two passes to trust in each frame, for a whole stretch at once.

Which pass is right is a hidden state of each frame: both, the forward one, the backward one, or
neither. The likeliest sequence of states is found by Viterbi's algorithm, from how highly the
responses peak, how well the passes agree, how they meet the human boxes at the far ends, and how
far the box would have to jump from one pass to the other.
"""

from enum import IntEnum

import numpy as np
import numpy.typing as npt

from situp_annotate.propagation.passes import Pass, peak_evidence

__all__ = ["Trust", "likeliest_trust"]

Array = npt.NDArray[np.float64]

_EVIDENCE_PER_OVERLAP = 14.0
_USUAL_OVERLAP = 0.5
_MOST_EVIDENCE = 6.0
_WEIGHT = 0.6
_SWITCH = 4.6
_NEITHER = 0.3
_JUMP = 6.0
_LONGEST_JUMP = 6.0
_SPEED = 0.1
_LONGEST_BRIDGE = 250


class Trust(IntEnum):
    """Which passes are taken to be right in a frame."""

    BOTH = 0
    FORWARD = 1
    BACKWARD = 2
    NEITHER = 3


_TRUSTED = np.array([Trust.BOTH, Trust.FORWARD, Trust.BACKWARD])
_FORWARD_RIGHT = np.array([True, True, False, False])
_BACKWARD_RIGHT = np.array([True, False, True, False])
_CHANGES = (_FORWARD_RIGHT[:, np.newaxis] != _FORWARD_RIGHT).astype(int) + (
    _BACKWARD_RIGHT[:, np.newaxis] != _BACKWARD_RIGHT
)
_SWITCHES = _SWITCH * _CHANGES[:3, :3]
_TO_NEITHER = _SWITCH * _CHANGES[:3, Trust.NEITHER]


def likeliest_trust(
    forward: Pass, backward: Pass, agreement: Array, paths: Array
) -> npt.NDArray[np.int64]:
    """The likeliest :class:`Trust` of each frame, (n,).

    Parameters
    ----------
    forward, backward : Pass
        Over the same stretch, both in the order of time; n ≥ 2 rows.
    agreement : ndarray
        (n,), overlap of both.
    paths : ndarray
        (n, 3, 4): where the box would be if both, the forward, the backward pass were right, as
        centre x, centre y, log width, log height.
    """
    evidence, neither = _evidence(forward, backward, agreement)
    best = np.full(evidence.shape, -np.inf)
    best[0] = evidence[0]
    came_from = np.zeros((*evidence.shape, 2), np.int64)
    columns = np.arange(len(_TRUSTED))
    for row in range(1, len(evidence)):
        start = max(0, row - _LONGEST_BRIDGE)
        gaps = np.arange(row - start, 0, -1)
        scores = best[start:row] + (neither[row - 1] - neither[start:row])[:, np.newaxis]
        scores = scores[:, :, np.newaxis] - _TO_NEITHER[:, np.newaxis] - _TO_NEITHER
        scores[-1] = best[row - 1][:, np.newaxis] - _SWITCHES
        scores -= _jump_costs(paths[start:row], paths[row], gaps)
        origin = scores.reshape(-1, len(_TRUSTED)).argmax(axis=0)
        came_from[row, :, 0], came_from[row, :, 1] = np.divmod(origin, len(_TRUSTED))
        best[row] = scores[came_from[row, :, 0], came_from[row, :, 1], columns] + evidence[row]
        came_from[row, :, 0] += start
    return _traced(came_from, int(best[-1].argmax()))


def _traced(came_from: npt.NDArray[np.int64], state: int) -> npt.NDArray[np.int64]:
    trust = np.full(len(came_from), Trust.NEITHER, np.int64)
    row = len(came_from) - 1
    while row > 0:
        trust[row] = state
        row, state = (int(number) for number in came_from[row, state])
    trust[0] = state
    return trust


def _evidence(forward: Pass, backward: Pass, agreement: Array) -> tuple[Array, Array]:
    """Log-likelihoods up to a constant of the frame.

    Returns
    -------
    evidence : ndarray
        (n, 3), of each trust but neither.
    neither : ndarray
        (n,), of neither, summed up to and with each frame.
    """
    same = _EVIDENCE_PER_OVERLAP * (agreement - _USUAL_OVERLAP)
    bounded = _WEIGHT * np.clip(same, -_MOST_EVIDENCE, _MOST_EVIDENCE)
    # At the ends one of the passes is the human box, and the other is right if it agrees.
    bounded[[0, -1]] = same[[0, -1]]
    parts = (
        (_FORWARD_RIGHT, peak_evidence(forward.peak)),
        (_BACKWARD_RIGHT, peak_evidence(backward.peak)),
        (_FORWARD_RIGHT & _BACKWARD_RIGHT, bounded),
    )
    evidence = np.zeros((len(agreement), len(Trust)))
    for holds, part in parts:
        evidence += np.outer(part, np.where(holds, 0.5, -0.5))
    evidence[0, ~_FORWARD_RIGHT] = evidence[-1, ~_BACKWARD_RIGHT] = -np.inf
    neither = np.nan_to_num(evidence[:, Trust.NEITHER] - _NEITHER, neginf=0.0)
    return evidence[:, : Trust.NEITHER], np.cumsum(neither)


def _jump_costs(before: Array, after: Array, gaps: npt.NDArray[np.int64]) -> Array:
    """What it costs to go from each path before to each path after, (gaps, 3, 3).

    The cost is for the way in sizes of the target, less what it may go in so many frames; staying
    with a path costs nothing.
    """
    apart = before[:, :, np.newaxis] - after
    size = np.exp((before[:, :, np.newaxis, 2:] + after[:, 2:]).sum(axis=-1) / 4)
    way = np.hypot(apart[..., 0], apart[..., 1]) / size - _SPEED * gaps[:, np.newaxis, np.newaxis]
    way = np.maximum(way, 0) + np.abs(apart[..., 2:]).sum(axis=-1)
    costs: Array = _JUMP * np.minimum(way, _LONGEST_JUMP)
    costs[-1, _TRUSTED, _TRUSTED] = 0.0
    return costs
