"""Where one more box is expected to help most."""

import math
from dataclasses import dataclass
from enum import StrEnum
from itertools import accumulate

import numpy as np
import numpy.typing as npt

from situp_annotate.propagation.confidence import PRECISE, Kind, probability
from situp_annotate.propagation.labels import Stretch, TrackLabels
from situp_annotate.types import Provenance

__all__ = ["Reason", "Suggestion", "suggest"]

Array = npt.NDArray[np.float64]

_KINDS = list(Kind)
_REACH = 0.25
_SHORTEST_REACH = 2.0
_LOW_AGREEMENT = 0.5
_LARGE_DRIFT = 0.25
_LEAST_GAIN = 0.5


class Reason(StrEnum):
    """Why a frame is worth a look."""

    DISAGREE = "passes disagree"
    LOST = "target lost"
    DRIFT = "scale runs away"
    BORDER = "near the border"
    CONFIDENCE = "confidence dips"


@dataclass(frozen=True, slots=True)
class Suggestion:
    """A frame in which a box should be drawn.

    Attributes
    ----------
    track_id, frame : int
        Where.
    reason : Reason
        Why.
    confidence : float
        Of the box that is there now, in [0, 1].
    gain : float
        How many frames more are expected to be right (overlap of at least 0.7) with a box there.
    """

    track_id: int
    frame: int
    reason: Reason
    confidence: float
    gain: float


def suggest(
    labels: TrackLabels, size_hw: tuple[int, int], *, most: int = 10
) -> tuple[Suggestion, ...]:
    """The frames of a track at which one box is expected to help most, best first.

    Each frame is expected to be wrong with some probability, and a box is expected to mend the
    frames around it, the less the further away, within its span. After each suggestion what it is
    expected to mend is taken off, so that the next one is elsewhere.

    Parameters
    ----------
    labels : TrackLabels
        The track.
    size_hw : tuple of int
        Height and width of the pictures in pixels.
    most : int
        How many at most; fewer where little is left to gain.
    """
    doubts = [_doubt(stretch) for stretch in labels.stretches]
    found: list[Suggestion] = []
    while len(found) < most:
        gains = [_gains(doubt) for doubt in doubts]
        peaks = [float(gain.max(initial=0.0)) for gain in gains]
        if not peaks or max(peaks) < _LEAST_GAIN:
            break
        number = int(np.argmax(peaks))
        stretch, row = labels.stretches[number], int(np.argmax(gains[number]))
        found.append(
            Suggestion(
                labels.track.id,
                stretch.start + row,
                _reason(stretch, row, size_hw),
                float(stretch.confidence[row]),
                peaks[number],
            )
        )
        doubts[number] = doubts[number] * (1 - _influence(row, len(stretch.boxes)))
    return tuple(found)


def _doubt(stretch: Stretch) -> Array:
    """Probability of each box to need a correction; 0 for human ones."""
    doubt = 1 - probability(stretch.evidence, PRECISE)
    human = [provenance is Provenance.HUMAN for provenance in stretch.provenances]
    return np.where(human, 0.0, doubt)


def _reach(count: int) -> float:
    """Frames after which a box takes away but 1/e of the doubt, in a span of so many."""
    return max(_SHORTEST_REACH, _REACH * count)


def _influence(row: int, count: int) -> Array:
    """Share of the doubt about each frame that a box in a frame takes away."""
    influence: Array = np.exp(-np.abs(np.arange(count) - row) / _reach(count))
    return influence


def _gains(doubt: Array) -> Array:
    """Frames expected to be mended by a box in each frame; none by one that is right already.

    Sums over all frames, weighted by influence, without a matrix: spans can be long.
    """
    decay = math.exp(-1 / _reach(len(doubt)))

    def decaying_sums(values: list[float]) -> Array:
        return np.fromiter(accumulate(values, lambda sum_, each: sum_ * decay + each), float)

    ahead = decaying_sums(doubt.tolist())
    behind = decaying_sums(doubt[::-1].tolist())[::-1]
    return doubt * (ahead + behind - doubt)


def _reason(stretch: Stretch, row: int, size_hw: tuple[int, int]) -> Reason:
    evidence = stretch.evidence
    kind = _KINDS[evidence.kind[row]]
    x, y, width, height = stretch.boxes[row]
    if kind is Kind.LOST:
        return Reason.LOST
    if kind in (Kind.BRIDGED, Kind.ONE_PASS) and evidence.agreement[row] < _LOW_AGREEMENT:
        return Reason.DISAGREE
    if x < 0 or y < 0 or x + width > size_hw[1] or y + height > size_hw[0]:
        return Reason.BORDER
    if evidence.drift[row] > _LARGE_DRIFT:
        return Reason.DRIFT
    return Reason.CONFIDENCE
