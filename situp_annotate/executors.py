"""Where the work on a video runs: each executor is a ``concurrent.futures.Executor``."""

import signal
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future
from multiprocessing import get_context
from typing import Any, TypeVar

from pebble import ProcessExpired, ProcessPool

from situp_annotate.errors import WorkerError

__all__ = ["ProcessExecutor", "SerialExecutor", "result_of"]

T = TypeVar("T")


class SerialExecutor(Executor):
    """Runs each call at once, in this process: for tests, debuggers and one small video."""

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:  # noqa: ANN401
        """Run the call; its future is done when this returns."""
        future: Future[T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001 - a future hands on whatever was raised
            future.set_exception(error)
        return future


def _start_worker(initializer: Callable[..., None], initargs: tuple[Any, ...]) -> None:
    # Ctrl-C reaches the whole process group; only the parent decides what it means.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    initializer(*initargs)


class ProcessExecutor(Executor):
    """Runs each call in a fresh process of its own, a limited number at a time.

    A process that dies takes only its own call with it: :func:`result_of` that call's future
    raises :class:`WorkerError`. The standard library's pool would lose every other call too.

    Parameters
    ----------
    workers : int
        Processes at a time; at least 1.
    initializer, initargs
        Called first in every process.
    """

    def __init__(
        self, workers: int, initializer: Callable[..., None], initargs: tuple[Any, ...]
    ) -> None:
        self._pool = ProcessPool(
            max_workers=workers,
            max_tasks=1,
            initializer=_start_worker,
            initargs=(initializer, initargs),
            context=get_context("spawn"),
        )

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:  # noqa: ANN401
        """Queue the call for the next free process."""
        future: Future[T] = self._pool.schedule(fn, args=args, kwargs=kwargs)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let queued calls finish, or with ``cancel_futures`` end all processes now."""
        if cancel_futures:
            self._pool.stop()
        else:
            self._pool.close()
        if wait:
            self._pool.join()


def result_of(future: Future[T]) -> T:
    """Result of a finished call.

    Raises
    ------
    WorkerError
        If its process died, or none could be started.
    """
    try:
        return future.result()
    except BrokenExecutor as error:
        raise WorkerError(
            "No worker process could be started; a script that starts a batch needs "
            '`if __name__ == "__main__":` around it.'
        ) from error
    except ProcessExpired as error:
        raise WorkerError(
            f"The process that annotated this video died ({_cause(error.exitcode)}); the other "
            f"videos are not affected."
        ) from error


def _cause(exitcode: int) -> str:
    if exitcode >= 0:
        return f"exit code {exitcode}"
    try:
        return signal.Signals(-exitcode).name
    except ValueError:
        return f"signal {-exitcode}"
