"""Decode ahead: the next frames are made in a thread while the present one is worked on."""

from collections import deque
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing, contextmanager

from situp_annotate.types import Frame

__all__ = ["reading_ahead"]

_AHEAD_BYTES = 32 * 2**20
_MOST_AHEAD = 64


def _read_ahead(frames: Iterator[Frame]) -> Generator[Frame]:
    pool = ThreadPoolExecutor(1)
    waiting: deque[Future[Frame | None]] = deque()
    try:
        waiting.append(pool.submit(next, frames, None))
        while (frame := waiting.popleft().result()) is not None:
            ahead = min(max(_AHEAD_BYTES // max(frame.image.nbytes, 1), 1), _MOST_AHEAD)
            while len(waiting) < ahead:
                waiting.append(pool.submit(next, frames, None))
            yield frame
    finally:
        pool.shutdown(cancel_futures=True)


@contextmanager
def reading_ahead(frames: Iterable[Frame], threads: int) -> Iterator[Iterator[Frame]]:
    """Take frames ahead, in a thread of its own, if there may be more than one.

    What `frames` raises comes out in its place, after the frames before it. When the context is
    left, early or not, the thread has ended.

    Parameters
    ----------
    frames : iterable of Frame
        Taken ahead by 32 MB of pictures, but by one frame at least and 64 at most.
    threads : int
        With one, nothing is taken ahead.

    Yields
    ------
    iterator of Frame
        The same frames in the same order.
    """
    if threads == 1:
        yield iter(frames)
        return
    with closing(_read_ahead(iter(frames))) as ahead:
        yield ahead
