"""The time of frames: where ticks go under a strip, and what a page must know to seek exactly."""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import Any

from situp_annotate.types import NS_PER_S
from situp_annotate.video.x264 import ticks

__all__ = ["Tick", "place_of", "step_runs", "ticks_of"]

_STEPS_S = (
    0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 43200,
)  # fmt: skip
_MOST_TICKS = 7


@dataclass(frozen=True, slots=True)
class Tick:
    """A mark under a strip.

    Attributes
    ----------
    place : float
        Where, in percent of the width.
    text : str
        The time.
    """

    place: float
    text: str


def place_of(frame: float, frame_count: int) -> float:
    """Where the middle of a frame is on a strip, in percent; all frames are as wide."""
    return round(100 * (frame + 0.5) / max(frame_count, 1), 3)


def _tick_text(seconds: float, step: float) -> str:
    if step < 1:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def ticks_of(times_ns: Sequence[int]) -> list[Tick]:
    """At most some seven round times, each where the first frame at or after it is."""
    if not times_ns:
        return []
    last = times_ns[-1] / NS_PER_S
    span = last - times_ns[0] / NS_PER_S
    step = next((each for each in _STEPS_S if span / each <= _MOST_TICKS), _STEPS_S[-1])
    found = []
    for number in range(int(last / step) + 1):
        frame = bisect_left(times_ns, round(number * step * NS_PER_S))
        if times_ns[0] / NS_PER_S <= number * step:
            place = place_of(frame, len(times_ns))
            found.append(Tick(place, _tick_text(number * step, step)))
    return found


def step_runs(times_ns: Sequence[int]) -> dict[str, Any]:
    """Times of all frames, briefly: of a constant frame rate mostly a single pair.

    Parameters
    ----------
    times_ns : sequence of int
        Time of each frame; increasing.

    Returns
    -------
    dict
        Plain JSON data: ``first``, the time of the first frame in the overlay's ticks of
        1/90000 s, and ``steps``, the steps from frame to frame in ticks, each with how often it
        comes in a row.
    """
    at = [ticks(time_ns) for time_ns in times_ns]
    steps = (after - before for before, after in pairwise(at))
    runs = [(step, sum(1 for _ in same)) for step, same in groupby(steps)]
    return {"first": at[0] if at else 0, "steps": runs}
