"""How far a batch has come."""

from dataclasses import dataclass, field

__all__ = ["BatchProgress", "RunningVideo"]


@dataclass(frozen=True, slots=True)
class RunningVideo:
    """A video that is being worked on.

    Attributes
    ----------
    id : str
        The video's id.
    frames_done, frames_expected : int
        Walked through so far, and how many that will be; 0 as long as nobody knows.
    seconds : float
        Since the work on it began.
    """

    id: str
    frames_done: int
    frames_expected: int
    seconds: float


@dataclass(frozen=True, slots=True)
class BatchProgress:
    """How far a batch has come.

    Attributes
    ----------
    videos_done, videos : int
        Finished or failed, and all.
    failed : int
        How many of those done failed.
    frames_done : int
        Walked through so far in this run: forward, backward, and once more for the overlay.
    frames_expected : int
        Estimate of all of them, from headers and from the videos already done.
    running : tuple of RunningVideo
        What is being worked on.
    """

    videos_done: int
    videos: int
    failed: int
    frames_done: int
    frames_expected: int
    running: tuple[RunningVideo, ...] = field(default=())
