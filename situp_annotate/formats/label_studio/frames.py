"""How Label Studio counts frames: by a clock, not in the file.

Its editor knows a frame rate and the player's time, no frames. Frame n, counted from 1, is the
moment (n − 1) ÷ rate, plus about 2 ms, to be past the beginning of a picture in spite of the
browser's rounding; what the player shows there is the picture (``goToFrame`` and
``frameSteppedTime`` in the editor's ``VideoCanvas.tsx``, since 2025). Where the time between
pictures varies, numbers of the file and of the editor are different things.

At the video's own frame rate, pictures that come in quick succession can share a number. With the
shortest time between two as the clock's tick, each has one of its own. So the rate that is written
next to the labels is the video's wherever that is enough, and otherwise a higher one.
"""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from math import ceil

from situp_annotate.formats.labelled import LabelledTrack, LabelledVideo
from situp_annotate.types import NS_PER_S, Provenance, TrackPoint

__all__ = ["clock_rate", "on_clock", "picture_at", "tick_count", "tick_of"]

_SHOWN_AFTER_NS = 2_001_000  # the odd microsecond: times in milliseconds are not on the border
_LOWEST_RATE = Fraction(1)  # the editor takes less for a duration
_HIGHEST_RATE = Fraction(500)  # browsers tell no times apart that are less than 2 ms apart


def _tick(time_ns: int, rate: Fraction) -> int:
    return 1 + ceil((time_ns - _SHOWN_AFTER_NS) * rate / NS_PER_S)


def tick_of(time_ns: int, rate: Fraction) -> int:
    """Number of the editor's first frame, from 1, that shows the picture of this time."""
    return max(1, _tick(time_ns, rate))


def picture_at(tick: int, rate: Fraction, times_ns: Sequence[int]) -> int:
    """Index of the picture that the editor shows at its frame `tick`."""
    moment_ns = (tick - 1) * NS_PER_S / rate + _SHOWN_AFTER_NS
    return max(0, bisect_right(times_ns, moment_ns) - 1)


def _as_float(rate: Fraction) -> Fraction:
    return Fraction(float(rate))


def clock_rate(video: LabelledVideo) -> Fraction:
    """Frames a second that Label Studio has to be told.

    Parameters
    ----------
    video : LabelledVideo
        The video; only the times of frames with labels matter.

    Returns
    -------
    Fraction
        From 1 to 500, and the value of a float, since that is how it is written.
    """
    rate = _as_float(min(max(_LOWEST_RATE, video.info.frame_rate), _HIGHEST_RATE))
    times = sorted(video.times_ns.items())
    ticks = [_tick(time_ns, rate) for _, time_ns in times]
    if any(one >= other for one, other in pairwise(ticks)):
        shortest = min(Fraction(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(times))
        rate = min(NS_PER_S / shortest, _HIGHEST_RATE) if shortest > 0 else _HIGHEST_RATE
    return _as_float(rate)


def tick_count(video: LabelledVideo, rate: Fraction) -> int:
    """How many frames the editor has to count, by a clock of this rate.

    These are all of the video's, as far as is known: as many as its mean frame rate gives, and as
    the times of labels do; with one more for the pictures that come after the last of them, if
    there are any.
    """
    count = max(1, round(video.frame_count / video.info.frame_rate * rate))
    if not video.times_ns:
        return count
    last = max(video.times_ns)
    is_followed = last + 1 < video.frame_count
    return max(count, tick_of(video.times_ns[last], rate) + is_followed)


def on_clock(
    track: LabelledTrack, times_ns: Mapping[int, int], rate: Fraction
) -> dict[int, TrackPoint]:
    """Labels by the editor's frame numbers.

    Parameters
    ----------
    track : LabelledTrack
        Labels by the file's frames.
    times_ns : mapping of int to int
        Time of each frame that has a label.
    rate : Fraction
        The clock's.

    Returns
    -------
    dict of int to TrackPoint
        The label of the picture that each frame of the editor shows. Of pictures that share a
        number, the last counts.
    """
    points: dict[int, TrackPoint] = {}
    for frame, point in track.points.items():
        tick = tick_of(times_ns[frame], rate)
        points[tick] = point
        following = times_ns.get(frame + 1)
        if following is not None:
            held = replace(point, provenance=Provenance.INTERPOLATED)
            points.update(dict.fromkeys(range(tick + 1, tick_of(following, rate)), held))
    return points
