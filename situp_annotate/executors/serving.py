"""What runs in a process that is there to make calls for another."""

import faulthandler
import os
import threading
from collections.abc import Callable
from multiprocessing import connection, parent_process
from multiprocessing.connection import Connection
from typing import Any

from situp_annotate.executors.counter import FrameCounter

__all__ = ["is_isolated", "report_frames", "serve"]

_counter: FrameCounter | None = None


def is_isolated() -> bool:
    """Whether this process is there to make calls for another."""
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


def _die_with_parent() -> None:
    """End this process when its parent does, however that ends: nothing is left behind."""
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _answer(fn: Callable[..., Any], args: tuple[Any, ...]) -> tuple[Any, BaseException | None]:
    try:
        return fn(*args), None
    except BaseException as error:  # noqa: BLE001 - whatever it is, it is the caller's
        return None, error


def serve(calls: Connection, counter: FrameCounter) -> None:
    """Make one call after the other, until no more can come.

    Parameters
    ----------
    calls : Connection
        Brings functions with their arguments, and takes what each returns and raises.
    counter : FrameCounter
        Told which process this is, and how far it is.
    """
    global _counter
    _counter = counter
    counter.note_pid()
    _die_with_parent()
    faulthandler.enable()
    while True:
        try:
            fn, args = calls.recv()
        except EOFError:
            return
        calls.send(_answer(fn, args))
