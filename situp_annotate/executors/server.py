"""Where fresh processes come from.

On Linux they are forked from one that has imported everything, so that a fresh one costs some
hundredths of a second; elsewhere each starts from nothing.
"""

import os
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.context import BaseContext
from multiprocessing.forkserver import ensure_running

from situp_annotate.executors.socket_folder import settle_socket_folder

__all__ = ["process_context", "start_server"]

_TIDYING = "situp_annotate.executors.tidying"

# Processes share the cores; libraries that start a thread a core would be in each other's way.
_ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS"), "1"
)


def process_context() -> BaseContext:
    """How processes are started here."""
    return get_context("forkserver" if sys.platform == "linux" else "spawn")


@contextmanager
def _one_thread() -> Iterator[None]:
    outside = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(_ONE_THREAD)
    try:
        yield
    finally:
        for name, value in outside.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def start_server(preload: Sequence[str]) -> None:
    """Start the process from which others are forked, if there is one and it is not running.

    Parameters
    ----------
    preload : sequence of str
        Modules that it imports before the first fork.
    """
    if sys.platform != "linux":
        return
    process_context().set_forkserver_preload([_TIDYING, *preload])
    settle_socket_folder()
    # Ctrl-C reaches the whole process group; only this process decides what it means.
    unblocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        with _one_thread():
            ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, unblocked)
