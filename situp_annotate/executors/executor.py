"""What every executor promises besides what the standard library says of executors."""

from abc import abstractmethod
from concurrent.futures import Executor, Future
from typing import Any

__all__ = ["VideoExecutor"]


class VideoExecutor(Executor):
    """Runs calls of which each works on one video.

    Exceptions of a future are those of the call, or a :class:`WorkerError` if its process died,
    was lost, or was stopped.

    Attributes
    ----------
    capacity : int
        Calls that are worth submitting at a time.
    """

    capacity: int

    @abstractmethod
    def frames(self, future: Future[Any]) -> tuple[int, int]:
        """How many frames of an unfinished call are done, and how many there will be.

        Both are 0 as long as nobody knows.
        """
