"""Imported where processes are forked: that process tidies up after a parent that was killed.

A parent that ends in good order removes the folder of the socket between the two itself.
"""

import atexit
import os
from contextlib import suppress
from multiprocessing import forkserver
from pathlib import Path

__all__: list[str] = []


def _remove_socket(server: int) -> None:
    address = getattr(forkserver._forkserver, "_forkserver_address", None)
    if os.getpid() != server or not isinstance(address, str):
        return
    with suppress(OSError):
        Path(address).unlink(missing_ok=True)
        Path(address).parent.rmdir()


atexit.register(_remove_socket, os.getpid())
