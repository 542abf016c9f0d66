"""What the times of a stream's packets say, without decoding and in bounded memory."""

import heapq
from collections import Counter
from fractions import Fraction

__all__ = ["PacketTimes"]

# Packets come in decode order; no codec lets a picture wait for more than 16 others.
_REORDER_DEPTH = 32
# Steps between pictures are counted by length, of which a sane stream has few.
_MAX_DISTINCT_STEPS = 1000
# A few unusable times, or one in so many, are mended picture by picture; beyond, all times are
# given up.
_FEW_FLAWS = 3
_PICTURES_PER_FLAW = 50


class PacketTimes:
    """Running figures over packets' times, in ticks of the stream.

    Attributes
    ----------
    count : int
        Pictures seen.
    flaws : int
        Times that are missing, double, or further out of order than reordering explains.
    first, last, end : int or None
        First and last time, and where the last picture ends.
    """

    def __init__(self) -> None:
        self.count = 0
        self.flaws = 0
        self.first: int | None = None
        self.last: int | None = None
        self.end: int | None = None
        self._reordering: list[int] = []
        self._previous: int | None = None
        self._steps: Counter[int] = Counter()
        self._other_steps = 0
        self._first_dts: int | None = None
        self._last_dts: int | None = None
        self._dts_usable = True

    def add(self, pts: int | None, dts: int | None, duration: int) -> None:
        """Take in one packet, in the file's order."""
        self.count += 1
        self._add_dts(dts)
        if pts is None:
            self.flaws += 1
            return
        if self.last is None or pts > self.last:
            self.last, self.end = pts, pts + duration
        self.first = pts if self.first is None else min(self.first, pts)
        heapq.heappush(self._reordering, pts)
        if len(self._reordering) > _REORDER_DEPTH:
            self._show(heapq.heappop(self._reordering))

    def finish(self) -> None:
        """Take in the end of the stream."""
        while self._reordering:
            self._show(heapq.heappop(self._reordering))

    def _add_dts(self, dts: int | None) -> None:
        if dts is None or (self._last_dts is not None and dts <= self._last_dts):
            self._dts_usable = False
            return
        if self._first_dts is None:
            self._first_dts = dts
        self._last_dts = dts

    def _show(self, pts: int) -> None:
        if self._previous is None:
            self._previous = pts
            return
        step = pts - self._previous
        if step <= 0:
            self.flaws += 1
            return
        self._previous = pts
        if step in self._steps or len(self._steps) < _MAX_DISTINCT_STEPS:
            self._steps[step] += 1
        else:
            self._other_steps += 1

    @property
    def usable(self) -> bool:
        """Whether the times can be trusted, but for a few that can be mended."""
        forgiven = max(_FEW_FLAWS, self.count // _PICTURES_PER_FLAW)
        return self.flaws <= forgiven and 2 * self.flaws < self.count

    @property
    def usual_step(self) -> int | None:
        """Median step from picture to picture; None with fewer than two pictures."""
        half = (self._steps.total() + 1) // 2
        for step in sorted(self._steps):
            half -= self._steps[step]
            if half <= 0:
                return step
        return None

    @property
    def regular(self) -> bool:
        """Whether nearly all steps are the usual one, so that a longer one tells of a loss."""
        usual = self.usual_step
        if usual is None:
            return False
        slack = max(1, usual // 10)  # one tick: 1/30 s is 33 or 34 ms in Matroska
        near = sum(count for step, count in self._steps.items() if abs(step - usual) <= slack)
        return near >= 0.9 * (self._steps.total() + self._other_steps)

    @property
    def pictures_per_tick(self) -> Fraction | None:
        """Average rate by presentation times, else by decoding times; None without either."""
        if self.count < 2:
            return None
        if self.usable and self.first is not None and self.last is not None:
            first, last = self.first, self.last
        elif self._dts_usable and self._first_dts is not None and self._last_dts is not None:
            first, last = self._first_dts, self._last_dts
        else:
            return None
        return Fraction(self.count - 1, last - first) if last > first else None
