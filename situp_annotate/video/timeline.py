"""Times of frames: strictly increasing whatever the stream says, and what is odd about them."""

from collections.abc import Iterator
from fractions import Fraction

from situp_annotate.types import NS_PER_S, Finding

__all__ = ["Timeline"]

_GAP_STEPS = 1.5


class Timeline:
    """Gives each frame its time.

    Parameters
    ----------
    frame_rate : Fraction
        Frames a second.
    from_stream : bool
        Whether frames have times of their own; else time is index ÷ `frame_rate`.
    usual_step_ns : int
        Median time from frame to frame.
    regular : bool
        Whether nearly all steps are the usual one, so that a longer one means lost frames. On a
        variable frame rate long steps are normal.

    Attributes
    ----------
    last_ns : int
        Time of the latest frame; -1 before the first one.
    """

    def __init__(
        self, *, frame_rate: Fraction, from_stream: bool, usual_step_ns: int, regular: bool
    ) -> None:
        self.last_ns = -1
        self._frame_rate = frame_rate
        self._from_stream = from_stream
        self._step_ns = usual_step_ns
        self._regular = regular
        self._origin_ns = 0

    def place(self, index: int, time_ns: int | None) -> tuple[int, list[Finding]]:
        """Return the time of frame `index`, whose stream says `time_ns`, and what is odd."""
        if not self._from_stream:
            self.last_ns = round(index * NS_PER_S / self._frame_rate)
            return self.last_ns, []
        if index == 0:
            # A few pictures may be shown before what the header calls the start.
            self._origin_ns = min(0, time_ns or 0)
        own_ns = None if time_ns is None else time_ns - self._origin_ns
        placed_ns = self._after_last(index, own_ns)
        findings = list(self._odd(index, own_ns, placed_ns))
        self.last_ns = placed_ns
        return placed_ns, findings

    def _after_last(self, index: int, own_ns: int | None) -> int:
        if own_ns is not None and own_ns > self.last_ns:
            return own_ns
        if index == 0:
            return 0
        # A frame without a time has a free place one step on. One with a time that is taken has
        # to share the step with the frame that follows.
        return self.last_ns + max(1, self._step_ns if own_ns is None else self._step_ns // 2)

    def _odd(self, index: int, own_ns: int | None, placed_ns: int) -> Iterator[Finding]:
        if own_ns != placed_ns:
            said = "has no time" if own_ns is None else f"has the time {own_ns / NS_PER_S:.3f} s"
            yield Finding(
                "timestamps",
                f"Frame {index} {said}, after {max(self.last_ns, 0) / NS_PER_S:.3f} s; it was "
                f"given {placed_ns / NS_PER_S:.3f} s.",
                index,
            )
        step_ns = placed_ns - self.last_ns
        if index > 0 and self._regular and step_ns > _GAP_STEPS * self._step_ns:
            missing = max(1, round(step_ns / self._step_ns) - 1)
            yield Finding(
                "gap",
                f"About {missing} frame{'s are' if missing > 1 else ' is'} missing before frame "
                f"{index} at {placed_ns / NS_PER_S:.3f} s: the time goes on by "
                f"{step_ns / 1e6:.0f} ms where it usually goes on by {self._step_ns / 1e6:.0f} ms. "
                "Frame numbers count the frames that are there.",
                index,
            )
