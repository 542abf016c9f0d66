"""Calls in another process, which may crash, hang or be killed without harm."""

import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import current_process
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
from situp_annotate.executors.counter import FrameCounter
from situp_annotate.executors.server import process_context
from situp_annotate.executors.serving import serve

__all__ = ["CallLimits", "IsolatedProcess"]

T = TypeVar("T")

_POLL_S = 0.1
_UNKNOWN_EXIT = 255  # of a process whose end nobody has seen


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


class IsolatedProcess:
    """A process that makes calls, one at a time.

    Attributes
    ----------
    counter : FrameCounter
        Says how far the call is that it is at.
    calls : int
        How many it has been given.
    """

    def __init__(self) -> None:
        self.counter = FrameCounter()
        self.calls = 0
        self._born = monotonic()
        context = process_context()
        self._line, theirs = context.Pipe()
        start = concurrent.process(name="situp-annotate", context=context)
        with _allowed_to_have_children():
            self._life: Future[None] = start(serve)(theirs, self.counter)
        theirs.close()

    @property
    def is_alive(self) -> bool:
        """Whether it can be given a call."""
        return not self._life.done()

    @property
    def age_s(self) -> float:
        """Seconds since its start."""
        return monotonic() - self._born

    def call(
        self,
        fn: Callable[..., T],
        args: tuple[Any, ...],
        *,
        limits: CallLimits,
        cancelled: threading.Event,
    ) -> T:
        """Make a call, and wait for it.

        Parameters
        ----------
        fn : callable
            A function of a module.
        args : tuple
            Its arguments.
        limits : CallLimits
            When to give up; that ends the process.
        cancelled : threading.Event
            Set, it ends the process.

        Raises
        ------
        WorkerError
            If the process dies or is stopped.
        CancelledError
            If it was cancelled.
        Exception
            Whatever the call raises.
        """
        self.calls += 1
        self.counter.restart()
        watch = _Watch(self.counter, limits)
        try:
            self._line.send((fn, args))
            while not self._line.poll(_POLL_S):
                if cancelled.is_set():
                    self._kill()
                    raise CancelledError
                if (error := watch.verdict) is not None:
                    self._kill()
                    raise error
            value, raised = self._line.recv()
        except (EOFError, ConnectionError) as error:
            raise self._death() from error
        if raised is not None:
            raise raised
        return value  # type: ignore[no-any-return]

    def end(self) -> None:
        """Let it end, and wait until it has."""
        self._line.close()
        if not self._life.cancelled():
            self._life.exception()

    def _kill(self) -> None:
        """End it, and wait until it is gone."""
        self._life.cancel()
        while self.counter.pid and psutil.pid_exists(self.counter.pid):
            sleep(_POLL_S / 10)

    def _death(self) -> WorkerError:
        error = self._life.exception()
        return _named_death(error.exitcode if isinstance(error, ProcessExpired) else None)


class _Watch:
    """Notices that a call takes too long, or stands still."""

    def __init__(self, counter: FrameCounter, limits: CallLimits) -> None:
        self._counter = counter
        self._limits = limits
        self._seen = counter.reports
        self._started = self._since = monotonic()

    @property
    def verdict(self) -> WorkerError | None:
        """What to say of the call if it is to be given up."""
        now, limits = monotonic(), self._limits
        if self._counter.reports != self._seen:
            self._seen, self._since = self._counter.reports, now
        if limits.timeout_s is not None and now - self._started > limits.timeout_s:
            return VideoTimeoutError(
                f"The video took longer than the {limits.timeout_s:g} s it was given and was "
                "stopped; try it with a longer --timeout: what was tracked so far is kept."
            )
        if limits.stall_s is not None and now - self._since > limits.stall_s:
            return VideoStalledError(
                f"The video came to no further frame for {limits.stall_s:g} s (after "
                f"{self._counter.frames[0]} frames of work) and was stopped; look at its log, try "
                "it with a longer --stall, or convert it anew."
            )
        return None


def _named_death(exitcode: int | None) -> WorkerError:
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
