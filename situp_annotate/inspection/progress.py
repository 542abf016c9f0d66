"""Telling, while a long file is gone through, how far it is."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

__all__ = ["OnProgress", "reporting"]

OnProgress: TypeAlias = Callable[[int, int | None], None]
"""Is told how much is done, and of how much if that is known."""

_POLL_S = 0.2


@contextmanager
def reporting(
    done: Callable[[], int], total: int | None, on_progress: OnProgress | None
) -> Iterator[None]:
    """Tell, from time to time, how far the work inside the ``with`` statement has come.

    Parameters
    ----------
    done : callable
        Returns how much is done; called from another thread.
    total : int or None
        How much there is to do.
    on_progress : callable or None
        Who is told; nobody if None.
    """
    if on_progress is None:
        yield
        return
    ended = threading.Event()

    def report() -> None:
        while not ended.wait(_POLL_S):
            on_progress(done(), total)

    thread = threading.Thread(target=report, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
