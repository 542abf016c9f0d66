"""What a worker of a Dask cluster does: one call, in a process of its own."""

import threading
from collections.abc import Callable
from concurrent.futures import CancelledError
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from situp_annotate.errors import SitupError
from situp_annotate.executors.counter import FrameCounter
from situp_annotate.executors.isolation import CallLimits, IsolatedProcess
from situp_annotate.executors.server import start_server
from situp_annotate.formats.disk import writing_to

__all__ = ["Answer", "ClusterCall", "frames_by_call", "run_call"]

_POLL_S = 0.2
_ENDS = ("closing", "closed", "failed")

_starting = threading.Lock()
_counters: dict[str, FrameCounter | None] = {}
"""Of each call that this worker is at, by the call's id; None as long as it waits for its lock."""


@dataclass(frozen=True, slots=True)
class ClusterCall:
    """A call that travels to a worker.

    Attributes
    ----------
    id : str
        Unlike that of any other call.
    fn : callable
        A function of a module.
    args : tuple
        Its arguments.
    lock : Path
        File on the shared disk; calls that have the same one wait for each other. Its folder is
        there.
    limits : CallLimits
        When to give up, waiting for the lock not counted.
    preload : tuple of str
        Modules that are imported once where processes are forked.
    """

    id: str
    fn: Callable[..., Any]
    args: tuple[Any, ...]
    lock: Path
    limits: CallLimits
    preload: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Answer:
    """How a call has ended; so that every exception of a task is one of Dask's own.

    Attributes
    ----------
    value : object
        What it returned.
    error : Exception or None
        What it raised.
    """

    value: Any = None
    error: Exception | None = None


class _Unwanted(threading.Event):
    """Is set once Dask does not want the task any more that makes this.

    The task was cancelled, whoever submitted it is gone, or the worker is being closed.
    """

    def __init__(self) -> None:
        from distributed import get_worker

        super().__init__()
        self._worker = get_worker()
        self._key = self._worker.get_current_task()

    def is_set(self) -> bool:
        task = self._worker.state.tasks.get(self._key)
        is_wanted = task is not None and task.state == "executing"
        return not is_wanted or self._worker.status.name in _ENDS


def frames_by_call() -> dict[str, tuple[int, int]]:
    """Frames done and expected of each call that this worker is at, by the call's id."""
    counters = _counters.copy().items()
    return {call: counter.frames if counter else (0, 0) for call, counter in counters}


def run_call(call: ClusterCall) -> Answer:
    """Run a call in a process that lives no longer than this worker, nor than Dask wants it to.

    Parameters
    ----------
    call : ClusterCall
        What to run.

    Raises
    ------
    CancelledError
        If Dask does not want it any more.
    FileNotFoundError
        If this machine does not see the shared disk.
    """
    if not call.lock.parent.is_dir():
        raise FileNotFoundError(f"{call.lock.parent}: this worker does not see this folder.")
    _counters[call.id] = None
    try:
        unwanted = _Unwanted()
        with _starting:
            start_server(call.preload)
        _wait_until_free(call.lock, unwanted)
        return _run_isolated(call, unwanted)
    except SitupError as error:
        return Answer(error=error)
    finally:
        del _counters[call.id]


def _run_isolated(call: ClusterCall, unwanted: threading.Event) -> Answer:
    process = IsolatedProcess()
    _counters[call.id] = process.counter
    try:
        return process.call(_run_alone, (call,), limits=call.limits, cancelled=unwanted)
    finally:
        process.end()


def _wait_until_free(lock: Path, unwanted: threading.Event) -> None:
    """Wait for the end of a process that a worker which was given up for lost may still have."""
    with writing_to(lock):
        while not unwanted.is_set():
            with suppress(Timeout), FileLock(lock, timeout=_POLL_S):
                return
    raise CancelledError


def _run_alone(call: ClusterCall) -> Answer:
    """In the process of the call: the lock is held as long as this lives, however it ends."""
    with writing_to(call.lock), FileLock(call.lock):
        try:
            return Answer(call.fn(*call.args))
        except Exception as error:  # noqa: BLE001 - whatever it is, it is the call's
            return Answer(error=error)
