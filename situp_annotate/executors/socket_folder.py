"""Where the socket lies through which processes are asked for."""

import hashlib
import os
import platform
import shutil
import tempfile
from multiprocessing import current_process
from multiprocessing.util import Finalize
from pathlib import Path

import psutil

__all__ = ["remove_abandoned_folders", "settle_socket_folder"]

_LONGEST = 56
"""Bytes that leave room for names in a socket's path, which may have 107."""
_SHORT = Path("/tmp")
_LATE = -100
"""When `multiprocessing` removes its own folder: after all that may still use it."""


def _prefix() -> str:
    """How names of the folders of this machine begin; before the number of the process."""
    return f"situp-{hashlib.sha256(platform.node().encode()).hexdigest()[:8]}-"


def _base() -> Path:
    """The usual temporary folder unless a socket's path would become too long there."""
    base = Path(tempfile.gettempdir())
    return base if len(os.fsencode(base)) <= _LONGEST else _SHORT


def remove_abandoned_folders() -> None:
    """Remove folders of processes that were killed before anything could tidy up after them."""
    for folder in _base().glob(f"{_prefix()}*"):
        owner = folder.name.removeprefix(_prefix()).partition("-")[0]
        if owner.isdecimal() and not psutil.pid_exists(int(owner)):
            shutil.rmtree(folder, ignore_errors=True)


def settle_socket_folder() -> None:
    """Let `multiprocessing` keep its socket in a folder whose owner can be told by its name."""
    config = current_process()._config  # type: ignore[attr-defined]
    if config.get("tempdir") is not None:
        return
    prefix = f"{_prefix()}{os.getpid()}-"
    folder = config["tempdir"] = tempfile.mkdtemp(prefix=prefix, dir=_base())
    Finalize(None, shutil.rmtree, (folder, True), exitpriority=_LATE)
