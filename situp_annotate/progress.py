"""How far a batch has come, told by its workers without locks."""

from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.sharedctypes import RawArray

import numpy as np

__all__ = ["BatchProgress", "FrameCounters"]


@dataclass(frozen=True, slots=True)
class BatchProgress:
    """How far a batch has come.

    Attributes
    ----------
    videos_done, videos : int
        Finished or failed, and all.
    frames_done : int
        Walked through so far: forward, backward, and once more for the overlay.
    frames_expected : int
        Estimate of all of them, from headers and from the videos already done.
    """

    videos_done: int
    videos: int
    frames_done: int
    frames_expected: int


class FrameCounters:
    """Frames done and promised of each job, in memory that workers write and the parent reads.

    Each slot has one writer and no lock, so a worker that dies cannot hold anybody up.
    """

    def __init__(self, jobs: int) -> None:
        self._shared = RawArray("q", max(2 * jobs, 1))

    def report(self, index: int, done: int, promised: int | None) -> None:
        """Note the frames done of a job and how many are expected; called by its worker."""
        self._shared[2 * index] = done
        self._shared[2 * index + 1] = promised or 0

    def progress(self, finished: Sequence[bool]) -> BatchProgress:
        """Sum up; ``finished`` says of each job whether it is through."""
        over = np.array(finished, dtype=bool)
        done, promised = np.array(self._shared, np.int64)[: 2 * over.size].reshape(-1, 2).T
        expected = np.where(over, done, np.maximum(done, promised))
        known = over | (promised > 0)
        usual = expected[known].mean() if known.any() else 0.0
        return BatchProgress(
            videos_done=int(over.sum()),
            videos=over.size,
            frames_done=int(done.sum()),
            frames_expected=int(expected.sum() + usual * (~known).sum()),
        )
