"""A track over time: its confidence and states, thinned out to what a strip on a page can show."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from situp_annotate.propagation import TrackLabels
from situp_annotate.types import Provenance, State

__all__ = [
    "STATES",
    "Figures",
    "Run",
    "Samples",
    "Strip",
    "figures_of",
    "lowest_profile",
    "profile",
    "profile_path",
    "samples_of",
    "strip_of",
]

Array = npt.NDArray[np.float64]
Codes = npt.NDArray[np.uint8]

STATES = (None, State.VISIBLE, State.OCCLUDED, State.LOST)
"""States by their code, from the best to the one that needs a look most; None is no box."""

_CODES = {state: np.uint8(code) for code, state in enumerate(STATES)}
_PROFILE_PARTS = 40


@dataclass(frozen=True, slots=True)
class Samples:
    """One track, frame by frame: arrays of (frames,).

    Attributes
    ----------
    confidence : ndarray
        In [0, 1]; NaN without a box.
    states : ndarray of uint8
        Place in ``STATES``.
    drawn, tracked : ndarray of bool
        Whether a person drew the box, and whether the tracker found it.
    """

    confidence: Array
    states: Codes
    drawn: npt.NDArray[np.bool_]
    tracked: npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Figures:
    """What is counted of a track.

    Attributes
    ----------
    boxes : int
        Frames with a box.
    drawn, tracked : int
        Boxes that a person drew, and that the tracker found.
    in_state : dict of State to int
        Frames in which the object is in each state.
    mean_confidence : float or None
        Over the boxes that no person drew; None without any.
    """

    boxes: int
    drawn: int
    tracked: int
    in_state: dict[State, int]
    mean_confidence: float | None


def figures_of(samples: Samples) -> Figures:
    """Count what a track has."""
    propagated = samples.confidence[(samples.states > 0) & ~samples.drawn]
    return Figures(
        boxes=int(np.count_nonzero(samples.states)),
        drawn=int(np.count_nonzero(samples.drawn)),
        tracked=int(np.count_nonzero(samples.tracked)),
        in_state={state: int(np.count_nonzero(samples.states == _CODES[state])) for state in State},
        mean_confidence=float(propagated.mean()) if propagated.size else None,
    )


def samples_of(labels: TrackLabels, frame_count: int) -> Samples:
    """Lay a track's labels out over all frames of its video."""
    samples = Samples(
        np.full(frame_count, np.nan),
        np.zeros(frame_count, np.uint8),
        np.zeros(frame_count, bool),
        np.zeros(frame_count, bool),
    )
    for stretch in reversed(labels.stretches):  # of a shared keyframe, the stretch before tells
        rows = slice(stretch.start, stretch.stop)
        samples.confidence[rows] = stretch.confidence
        samples.states[rows] = [_CODES[state] for state in stretch.states]
        samples.drawn[rows] = [each is Provenance.HUMAN for each in stretch.provenances]
        samples.tracked[rows] = [each is Provenance.TRACKED for each in stretch.provenances]
    return samples


@dataclass(frozen=True, slots=True)
class Run:
    """Neighbouring frames in one state.

    Attributes
    ----------
    first, last : int
        Its frames.
    code : int
        Place of the state in ``STATES``.
    lowest : float or None
        Lowest confidence; None without boxes.
    """

    first: int
    last: int
    code: int
    lowest: float | None

    @property
    def state(self) -> State | None:
        """The state; None where there is no box."""
        return STATES[self.code]


@dataclass(frozen=True, slots=True)
class Strip:
    """What is drawn of a track.

    Attributes
    ----------
    percent : tuple of int
        Lowest confidence in each of as many equal parts of the video, 0 to 100; −1 without a box.
    path : str
        The same as SVG path data, one unit wide a part, 100 high.
    runs : tuple of Run
        The states.
    """

    percent: tuple[int, ...]
    path: str
    runs: tuple[Run, ...]


def _edges(frame_count: int, parts: int) -> npt.NDArray[np.int64]:
    """First frame of each part, and the end: at most as many parts as frames."""
    parts = max(min(parts, frame_count), 1)
    return np.arange(parts + 1) * frame_count // parts


def _lowest(confidence: Array, edges: npt.NDArray[np.int64]) -> Array:
    """Lowest confidence in each part; NaN where there is no box."""
    if not confidence.size:
        return np.empty(0)
    lowest = np.minimum.reduceat(np.where(np.isnan(confidence), np.inf, confidence), edges[:-1])
    return np.where(np.isinf(lowest), np.nan, lowest)


def _runs(samples: Samples, edges: npt.NDArray[np.int64]) -> tuple[Run, ...]:
    """States of the parts between edges, each by its worst frame, neighbours that are alike joined.

    Parts without a box are left out.
    """
    if not samples.states.size:
        return ()
    worst = np.maximum.reduceat(samples.states, edges[:-1])
    changes = [0, *(np.flatnonzero(np.diff(worst)) + 1), len(worst)]
    runs = []
    for start, stop in pairwise(changes):
        if worst[start]:
            first, end = int(edges[start]), int(edges[stop])
            lowest = float(np.nanmin(samples.confidence[first:end]))
            runs.append(Run(first, end - 1, int(worst[start]), lowest))
    return tuple(runs)


def _path(percent: tuple[int, ...]) -> str:
    """An area with steps on top: relative moves, since those are the shortest."""
    path, height, wide = [], -1, 0
    for place, value in enumerate((*percent, -1)):
        if value == height:
            wide += 1
            continue
        if height >= 0:
            path.append(f"h{wide}" + (f"v{height - value}" if value >= 0 else f"v{height}z"))
        if height < 0:
            path.append(f"M{place} 100v-{value}")
        height, wide = value, 1
    return "".join(path)


def strip_of(samples: Samples, *, columns: int, most_runs: int) -> Strip:
    """Thin a track out to what a strip can show; what needs a look is what is kept.

    Parameters
    ----------
    samples : Samples
        The track.
    columns : int
        Parts at most that confidence is shown in.
    most_runs : int
        Runs at most; states that change more often are told for longer and longer parts.
    """
    frame_count = len(samples.states)
    lowest = _lowest(samples.confidence, _edges(frame_count, columns))
    percent = tuple(int(value) for value in np.nan_to_num(np.round(100 * lowest), nan=-1))
    parts = frame_count
    runs = _runs(samples, _edges(frame_count, parts))
    while len(runs) > most_runs and parts > 1:
        parts //= 2
        runs = _runs(samples, _edges(frame_count, parts))
    return Strip(percent, _path(percent), runs)


def profile(labels: TrackLabels, frame_count: int) -> str:
    """How confidence runs through the video, in a word.

    Parameters
    ----------
    labels : TrackLabels
        The track.
    frame_count : int
        Frames of the video.

    Returns
    -------
    str
        Lowest confidence in each of at most 40 equal parts of the video, in tenths from 0 to 9;
        "." where there is no box.
    """
    confidence = samples_of(labels, frame_count).confidence
    lowest = _lowest(confidence, _edges(frame_count, _PROFILE_PARTS))
    return "".join("." if np.isnan(each) else str(min(int(10 * each), 9)) for each in lowest)


def profile_path(tenths: str) -> str:
    """SVG path data of a :func:`profile`, one unit wide a part, 100 high."""
    return _path(tuple(-1 if each == "." else 10 * int(each) + 10 for each in tenths))


def lowest_profile(profiles: Sequence[str]) -> str:
    """The lowest of several tracks' profiles at each place."""
    return "".join(
        min(tenths, key=lambda each: (each == ".", each)) for tenths in zip(*profiles, strict=True)
    )
