"""Work in a thread of its own, in order, so that it overlaps with what its caller does."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Generic, ParamSpec

__all__ = ["Background"]

_MOST_WAITING = 4

_Arguments = ParamSpec("_Arguments")


class Background(Generic[_Arguments]):
    """Calls a function in a thread of its own, one call after the other.

    A call returns at once, unless four are waiting already. What a call raises comes out of a
    later one, or of `finish`; the function is not called any more then.

    Parameters
    ----------
    function : callable
        What to call; it returns nothing.
    """

    def __init__(self, function: Callable[_Arguments, None]) -> None:
        self._function = function
        self._pool = ThreadPoolExecutor(1)
        self._waiting: deque[Future[None]] = deque()
        self._failed = False

    def __call__(self, *args: _Arguments.args, **kwargs: _Arguments.kwargs) -> None:
        """Have the function called with these arguments."""
        if len(self._waiting) >= _MOST_WAITING:
            self._waiting.popleft().result()
        self._waiting.append(self._pool.submit(self._run, *args, **kwargs))

    def _run(self, *args: _Arguments.args, **kwargs: _Arguments.kwargs) -> None:
        if self._failed:
            return
        try:
            self._function(*args, **kwargs)
        except BaseException:
            self._failed = True
            raise

    def finish(self) -> None:
        """Wait for all calls."""
        while self._waiting:
            self._waiting.popleft().result()

    def close(self) -> None:
        """Forget the calls that are waiting, and end the thread."""
        self._pool.shutdown(cancel_futures=True)
