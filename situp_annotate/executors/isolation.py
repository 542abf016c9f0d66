"""One call in a process of its own, which may crash, hang or be killed without harm.

On Linux processes are forked from one that has imported everything, so that a fresh one costs
some hundredths of a second; elsewhere each starts from nothing.
"""

import faulthandler
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import connection, current_process, get_context, parent_process
from multiprocessing.context import BaseContext
from multiprocessing.forkserver import ensure_running
from multiprocessing.sharedctypes import RawArray
from time import monotonic, sleep
from typing import Any, TypeVar

import psutil
from pebble import ProcessExpired, concurrent

from situp_annotate.errors import (
    VideoStalledError,
    VideoTimeoutError,
    WorkerError,
    WorkerKilledError,
)

__all__ = [
    "CallLimits",
    "FrameCounter",
    "is_isolated",
    "report_frames",
    "run_isolated",
    "start_server",
]

T = TypeVar("T")

_POLL_S = 0.1
_TIDYING = "situp_annotate.executors.tidying"
_UNKNOWN_EXIT = 255  # of a process whose end nobody has seen

# Processes share the cores; libraries that start a thread a core would be in each other's way.
_ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS"), "1"
)


@dataclass(frozen=True, slots=True)
class CallLimits:
    """When a call is given up.

    Attributes
    ----------
    timeout_s : float or None
        Seconds that a call may take; None for as long as it wants.
    stall_s : float or None
        Seconds that may pass without a report from it; None for as long as it wants.
    """

    timeout_s: float | None = None
    stall_s: float | None = None


class FrameCounter:
    """Frames done and expected of one call, in memory that its process shares with its parent.

    There is one writer and no lock, so that a process that dies cannot hold anybody up.
    """

    def __init__(self) -> None:
        self._shared = RawArray("q", 4)

    def report(self, done: int, expected: int | None) -> None:
        """Note how far the call is; called by its process."""
        self._shared[1] = expected or 0
        self._shared[0] = done
        self._shared[3] += 1

    def note_pid(self) -> None:
        """Note which process this is."""
        self._shared[2] = os.getpid()

    @property
    def frames(self) -> tuple[int, int]:
        """Frames done and expected."""
        return self._shared[0], self._shared[1]

    @property
    def reports(self) -> int:
        """How often the call has reported; a sign of life even where no frame is done."""
        return int(self._shared[3])

    @property
    def pid(self) -> int:
        """Process of the call; 0 as long as it has not begun."""
        return int(self._shared[2])


def _context() -> BaseContext:
    return get_context("forkserver" if sys.platform == "linux" else "spawn")


def start_server(preload: Sequence[str]) -> None:
    """Start the process from which others are forked, if there is one and it is not running.

    Parameters
    ----------
    preload : sequence of str
        Modules that it imports before the first fork.
    """
    if sys.platform != "linux":
        return
    _context().set_forkserver_preload([_TIDYING, *preload])
    outside = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(_ONE_THREAD)
    # Ctrl-C reaches the whole process group; only this process decides what it means.
    unblocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, unblocked)
        for name, value in outside.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


# ---- in the process of the call --------------------------------------------------------------


def _die_with_parent() -> None:
    """End this process when its parent does, however that ends: nothing is left behind."""
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


_counter: FrameCounter | None = None


def is_isolated() -> bool:
    """Whether this process is there for one call, and ends with it."""
    return _counter is not None


def report_frames(done: int, expected: int | None) -> None:
    """Say how far the call is that runs in this process; nobody hears it where none does.

    Parameters
    ----------
    done : int
        Frames done.
    expected : int or None
        How many there will be; None when nobody knows.
    """
    if _counter is not None:
        _counter.report(done, expected)


def _enter(fn: Callable[..., T], args: Sequence[Any], counter: FrameCounter) -> T:
    global _counter
    _counter = counter
    counter.note_pid()
    _die_with_parent()
    faulthandler.enable()
    return fn(*args)


# ---- in the process that waits for it ---------------------------------------------------------


@contextmanager
def _allowed_to_have_children() -> Iterator[None]:
    """Let a daemonic process, as workers of Dask are, start others: these die with it anyway."""
    config = current_process()._config  # type: ignore[attr-defined]
    daemonic = config.pop("daemon", None)
    try:
        yield
    finally:
        if daemonic is not None:
            config["daemon"] = daemonic


def run_isolated(
    fn: Callable[..., T],
    args: Sequence[Any],
    *,
    limits: CallLimits,
    counter: FrameCounter | None = None,
    cancelled: threading.Event | None = None,
) -> T:
    """Run a call in a fresh process, and wait for it.

    Parameters
    ----------
    fn : callable
        A function of a module.
    args : sequence
        Its arguments.
    limits : CallLimits
        When to give up.
    counter : FrameCounter, optional
        Says how far the call is.
    cancelled : threading.Event, optional
        Set, it ends the call.

    Raises
    ------
    WorkerError
        If the process dies or is stopped; with the call's exception where there is one.
    CancelledError
        If it was cancelled.
    """
    counter, cancelled = counter or FrameCounter(), cancelled or threading.Event()
    start = concurrent.process(name="situp-annotate", timeout=limits.timeout_s, context=_context())
    with _allowed_to_have_children():
        future: Future[T] = start(_enter)(fn, args, counter)
    stall = _StallWatch(counter, limits.stall_s)
    while not wait([future], timeout=_POLL_S).done:
        if cancelled.is_set() or stall.is_over:
            future.cancel()
            _wait_for_end(counter.pid)
            break
    if cancelled.is_set():
        raise CancelledError
    if future.cancelled():
        raise VideoStalledError(
            f"The video came to no further frame for {limits.stall_s:g} s (after "
            f"{counter.frames[0]} frames of work) and was stopped; look at its log, try it with a "
            "longer --stall, or convert it anew."
        )
    return _result_of(future, limits)


class _StallWatch:
    """Notices that a counter stands still."""

    def __init__(self, counter: FrameCounter, stall_s: float | None) -> None:
        self._counter = counter
        self._stall_s = stall_s
        self._seen = counter.reports
        self._since = monotonic()

    @property
    def is_over(self) -> bool:
        """Whether it has stood still for too long."""
        if self._counter.reports != self._seen:
            self._seen, self._since = self._counter.reports, monotonic()
        return self._stall_s is not None and monotonic() - self._since > self._stall_s


def _wait_for_end(pid: int) -> None:
    """Wait until a process that is being stopped is gone."""
    while pid and psutil.pid_exists(pid):
        sleep(_POLL_S / 10)


def _result_of(future: Future[T], limits: CallLimits) -> T:
    try:
        return future.result()
    except TimeoutError as error:
        raise VideoTimeoutError(
            f"The video took longer than the {limits.timeout_s:g} s it was given and was stopped; "
            "try it with a longer --timeout: what was tracked so far is kept."
        ) from error
    except ProcessExpired as error:
        raise _death(error.exitcode) from error


def _death(exitcode: int | None) -> WorkerError:
    """What it means that a process ended so."""
    if exitcode == -signal.SIGKILL:
        return WorkerKilledError(
            "The process that annotated this video was killed (SIGKILL), by the system for want "
            "of memory or by somebody; try it with fewer --workers."
        )
    if exitcode is not None and abs(exitcode) == signal.SIGTERM:  # pebble exits with its number
        return WorkerKilledError(
            "The process that annotated this video was stopped from outside (SIGTERM)."
        )
    return WorkerError(
        f"The process that annotated this video crashed ({_cause(exitcode)}); its log has more. "
        "Convert the video anew, or report it."
    )


def _cause(exitcode: int | None) -> str:
    if exitcode is None or exitcode == _UNKNOWN_EXIT:
        return "for an unknown cause"
    if exitcode >= 0:
        return f"exit code {exitcode}"
    try:
        return signal.Signals(-exitcode).name
    except ValueError:
        return f"signal {-exitcode}"
