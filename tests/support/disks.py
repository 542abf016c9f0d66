"""Small disks in memory that can be filled, locked and taken away, for those who may mount."""

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

__all__ = ["SmallDisk", "small_disk"]

_PLENTY = "size=64m,nr_inodes=10000"


class SmallDisk:
    """A disk in memory.

    Parameters
    ----------
    place : Path
        An empty folder to mount it in.
    """

    def __init__(self, place: Path) -> None:
        self.place = place
        _call("mount", "-t", "tmpfs", "-o", _PLENTY, "tmpfs", place)

    def leave_bytes(self, count: int) -> None:
        """Leave so many bytes free, or up to a page more; something must be on it."""
        status = os.statvfs(self.place)
        self._change(f"size={(status.f_blocks - status.f_bfree) * status.f_frsize + count}")

    def leave_names(self, count: int) -> None:
        """Let so many files and folders be made."""
        status = os.statvfs(self.place)
        self._change(f"nr_inodes={status.f_files - status.f_ffree + count}")

    def leave_plenty(self) -> None:
        """Let all be written again."""
        self._change(_PLENTY)

    def lock(self) -> None:
        """Let nothing be written."""
        self._change("ro")

    def take_away(self) -> None:
        """Leave an empty folder, whatever is open."""
        _call("umount", "--lazy", self.place)

    def _change(self, options: str) -> None:
        _call("mount", "-o", f"remount,{options}", self.place)


def _call(*arguments: object) -> None:
    subprocess.run([*map(str, arguments)], check=True, capture_output=True, text=True, timeout=10)


@contextmanager
def small_disk(place: Path) -> Iterator[SmallDisk]:
    """Have a disk for a while; skip the test where none can be mounted.

    Parameters
    ----------
    place : Path
        Made. Nothing may be open on the disk in the end.
    """
    place.mkdir()
    try:
        disk = SmallDisk(place)
    except (OSError, subprocess.SubprocessError) as error:
        reason = getattr(error, "stderr", None) or str(error)
        pytest.skip(f"no disk can be mounted here: {reason.splitlines()[0]}")
    try:
        yield disk
        if place.is_mount():
            _call("umount", place)  # which fails if a file is still open
    finally:
        if place.is_mount():
            disk.take_away()
