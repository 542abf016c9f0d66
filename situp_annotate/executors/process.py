"""Run the work on videos in processes of this machine."""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Any, TypeVar

from situp_annotate.executors.executor import VideoExecutor
from situp_annotate.executors.isolation import (
    CallLimits,
    FrameCounter,
    run_isolated,
    start_server,
)

__all__ = ["ProcessExecutor"]

T = TypeVar("T")


class ProcessExecutor(VideoExecutor):
    """Runs each call in a fresh process of its own, a limited number at a time.

    A process that dies or is stopped takes only its own call with it. The standard library's pool
    would lose every other call too, and cannot stop one that hangs.

    Parameters
    ----------
    workers : int
        Processes at a time; at least 1.
    limits : CallLimits, optional
        When a call is given up.
    preload : sequence of str
        Modules that processes need, imported once where processes are forked.
    """

    def __init__(
        self, workers: int, limits: CallLimits | None = None, preload: Sequence[str] = ()
    ) -> None:
        self.capacity = workers
        self._limits = limits or CallLimits()
        self._stopped = threading.Event()
        self._counters: dict[Future[Any], FrameCounter] = {}
        # A thread waits for each process.
        self._threads = ThreadPoolExecutor(workers, thread_name_prefix="situp-annotate")
        start_server(preload)

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:  # noqa: ANN401
        """Queue the call for the next process."""
        counter = FrameCounter()
        future = self._threads.submit(
            run_isolated,
            partial(fn, **kwargs),
            args,
            limits=self._limits,
            counter=counter,
            cancelled=self._stopped,
        )
        self._counters[future] = counter
        future.add_done_callback(self._counters.pop)
        return future

    def frames(self, future: Future[Any]) -> tuple[int, int]:
        """How many frames of an unfinished call are done, and how many there will be."""
        counter = self._counters.get(future)
        return counter.frames if counter else (0, 0)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let queued calls finish, or with ``cancel_futures`` end all processes now."""
        if cancel_futures:
            self._stopped.set()
        self._threads.shutdown(wait, cancel_futures=cancel_futures)
