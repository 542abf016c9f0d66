"""Run the work on videos in processes of this machine."""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

from situp_annotate.errors import VideoStalledError, VideoTimeoutError, WorkerError
from situp_annotate.executors.executor import VideoExecutor
from situp_annotate.executors.isolation import CallLimits, IsolatedProcess
from situp_annotate.executors.server import start_server

__all__ = ["ProcessExecutor"]

T = TypeVar("T")


@dataclass(slots=True)
class _Call:
    """A call, and the process that is at it."""

    fn: Callable[..., Any]
    args: tuple[Any, ...]
    process: IsolatedProcess | None = None


class ProcessExecutor(VideoExecutor):
    """Runs each call in a process, a limited number at a time.

    Each call has a fresh process, unless short ones may share. A process that dies or is stopped
    takes no other call with it, as one of the standard library's pool would: a call that was not
    the first of its process is made again in a fresh one, for an earlier one may be to blame.

    Parameters
    ----------
    workers : int
        Processes at a time; at least 1.
    limits : CallLimits, optional
        When a call is given up.
    preload : sequence of str
        Modules that processes need, imported once where processes are forked.
    shared_for_s : float
        Seconds from its start in which a process takes further calls, so that many short ones do
        not each wait for a start.
    """

    def __init__(
        self,
        workers: int,
        limits: CallLimits | None = None,
        preload: Sequence[str] = (),
        *,
        shared_for_s: float = 0.0,
    ) -> None:
        self.capacity = workers
        self._shared_for_s = shared_for_s
        self._limits = limits or CallLimits()
        self._stopped = threading.Event()
        self._calls: dict[Future[Any], _Call] = {}
        self._idle: list[IsolatedProcess] = []
        # A thread waits for each process.
        self._threads = ThreadPoolExecutor(workers, thread_name_prefix="situp-annotate")
        start_server(preload)

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:  # noqa: ANN401
        """Queue the call for the next process."""
        call = _Call(partial(fn, **kwargs), args)
        future = self._threads.submit(self._make, call)
        self._calls[future] = call
        future.add_done_callback(self._calls.pop)
        return future

    def frames(self, future: Future[Any]) -> tuple[int, int]:
        """How many frames of an unfinished call are done, and how many there will be."""
        call = self._calls.get(future)
        return call.process.counter.frames if call and call.process else (0, 0)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let queued calls finish, or with ``cancel_futures`` end all processes now."""
        if cancel_futures:
            self._stopped.set()
        self._threads.shutdown(wait, cancel_futures=cancel_futures)
        while self._idle:
            self._idle.pop().end()

    def _make(self, call: _Call) -> Any:  # noqa: ANN401
        try:
            return self._make_in(self._take_process(), call)
        except (VideoTimeoutError, VideoStalledError):
            raise
        except WorkerError:
            if call.process is None or call.process.calls == 1:
                raise
            return self._make_in(IsolatedProcess(), call)

    def _make_in(self, process: IsolatedProcess, call: _Call) -> Any:  # noqa: ANN401
        call.process = process
        try:
            return process.call(call.fn, call.args, limits=self._limits, cancelled=self._stopped)
        finally:
            self._give_back(process)

    def _take_process(self) -> IsolatedProcess:
        while self._idle:
            process = self._idle.pop()
            if process.is_alive:
                return process
        return IsolatedProcess()

    def _give_back(self, process: IsolatedProcess) -> None:
        if process.is_alive and process.age_s < self._shared_for_s:
            self._idle.append(process)
        else:
            process.end()
