"""How far a call is, in memory that its process shares with the one that waits for it."""

import os
from multiprocessing.sharedctypes import RawArray

__all__ = ["FrameCounter"]


class FrameCounter:
    """Frames done and expected of the call that a process is at.

    There is one writer at a time and no lock, so that a process that dies cannot hold anybody up.
    """

    def __init__(self) -> None:
        self._shared = RawArray("q", 4)

    def restart(self) -> None:
        """Forget the last call, when the next one is made."""
        self._shared[0] = self._shared[1] = 0
        self._shared[3] += 1

    def report(self, done: int, expected: int | None) -> None:
        """Note how far the call is; called by its process."""
        self._shared[1] = expected or 0
        self._shared[0] = done
        self._shared[3] += 1

    def note_pid(self) -> None:
        """Note which process this is."""
        self._shared[2] = os.getpid()

    @property
    def frames(self) -> tuple[int, int]:
        """Frames done and expected."""
        return self._shared[0], self._shared[1]

    @property
    def reports(self) -> int:
        """How often there was news; a sign of life even where no frame is done."""
        return int(self._shared[3])

    @property
    def pid(self) -> int:
        """The process; 0 as long as it has not begun."""
        return int(self._shared[2])
