"""Which packet each frame of a forward pass comes from, by the times that the pass gave."""

from array import array
from bisect import bisect_left
from collections.abc import Sequence

import numpy as np

__all__ = ["FrameFollower", "FrameOrder"]

# OpenCV gives times as floating-point milliseconds, which moves them by a nanosecond at most.
_TOLERANCE_NS = 1000
_UNKNOWN = -1


class FrameOrder:
    """Frames' indices against packets' numbers, as far as they are known.

    Parameters
    ----------
    packets : int
        How many there are.

    Attributes
    ----------
    known : int
        All frames below this index have been looked for.
    """

    def __init__(self, packets: int) -> None:
        self.known = 0
        self._index_of = array("q", [_UNKNOWN]) * packets

    @classmethod
    def by_times(
        cls,
        times_ns: Sequence[int],
        packet_times_ns: Sequence[int | None],
        *,
        first: int,
    ) -> "FrameOrder":
        """Match all frames to packets by their times; nothing is known unless all have a match.

        Parameters
        ----------
        times_ns : sequence of int
            Times of the frames of the forward pass, by index, strictly increasing.
        packet_times_ns : sequence of int or None
            Times of the packets as the stream says, by number.
        first : int
            Number of the packet that the first frame comes from.
        """
        order = cls(len(packet_times_ns))
        origin_ns = min(0, packet_times_ns[first] or 0)  # as Timeline does it
        timed = [(t - origin_ns, n) for n, t in enumerate(packet_times_ns) if t is not None]
        own_ns, numbers = np.array(sorted(timed), dtype=np.int64).reshape(-1, 2).T
        wanted_ns = np.asarray(times_ns, dtype=np.int64)
        places = np.searchsorted(own_ns, wanted_ns - _TOLERANCE_NS, side="left")
        beyond = np.searchsorted(own_ns, wanted_ns + _TOLERANCE_NS, side="right")
        single = bool(np.all(beyond - places == 1) and np.all(np.diff(places) > 0))
        if not single or len(places) == 0 or numbers[places[0]] != first:
            return order
        for index, number in enumerate(numbers[places].tolist()):
            order.record(index, number)
        return order

    def record(self, index: int, number: int | None) -> None:
        """Take in that frame `index` comes from packet `number`."""
        self.known = max(self.known, index + 1)
        if number is not None and 0 <= number < len(self._index_of):
            self._index_of[number] = index

    def index_of(self, number: int | None) -> int | None:
        """Index of the frame that comes from packet `number`; None when none is known to."""
        if number is None or not 0 <= number < len(self._index_of):
            return None
        index = self._index_of[number]
        return None if index == _UNKNOWN else index


class FrameFollower:
    """Finds the index of each picture while a video is decoded from its start.

    Times tell where the forward pass has dropped a picture that comes now, or had one that does
    not come now; apart from that pictures are counted.

    Parameters
    ----------
    times_ns : sequence of int
        Times of the frames of the forward pass, by index, strictly increasing.
    from_stream : bool
        Whether they are the stream's own, but for those that the pass had to move.
    """

    def __init__(self, times_ns: Sequence[int], *, from_stream: bool) -> None:
        self._times_ns = times_ns
        self._from_stream = from_stream
        self._origin_ns: int | None = None
        self._next = 0

    def place(self, time_ns: int | None) -> int | None:
        """Return the index of the next picture; None when the forward pass did not have it.

        Parameters
        ----------
        time_ns : int or None
            Its time as the stream says.
        """
        if self._origin_ns is None:
            self._origin_ns = min(0, time_ns or 0)  # as Timeline does it
        own_ns = None if time_ns is None else time_ns - self._origin_ns
        index = self._find(own_ns)
        if index is None or index >= len(self._times_ns):
            return None
        self._next = index + 1
        return index

    def _find(self, own_ns: int | None) -> int | None:
        last_ns = self._times_ns[self._next - 1] if self._next else -1
        if not self._from_stream or own_ns is None or own_ns <= last_ns + _TOLERANCE_NS:
            return self._next  # by count: the forward pass has moved its time
        index = bisect_left(self._times_ns, own_ns - _TOLERANCE_NS, lo=self._next)
        if index < len(self._times_ns) and self._times_ns[index] <= own_ns + _TOLERANCE_NS:
            return index
        return None
