"""The disk: whether something is there, that it stays there, and what is said when it refuses."""

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from situp_annotate.errors import DiskError, OutputError

__all__ = ["is_there", "make_folder", "remove", "sync", "sync_tree", "writing_to"]

_ADVICE = {
    "free some space and run again": (errno.ENOSPC, errno.EDQUOT),
    "make it writable, or choose another place": (
        *(errno.EROFS, errno.EACCES, errno.EPERM, errno.ENOTDIR),
    ),
    "see that the folder is there, and run again": (
        *(errno.ENOENT, errno.EIO, errno.ESTALE, errno.ENOTCONN),
        *(errno.ENODEV, errno.ETIMEDOUT, errno.EHOSTDOWN),
    ),
}
"""What to do about errors that are the disk's or the folder's, not those of one file."""

_NO_SYNC = (errno.EINVAL, errno.EBADF)
"""What file systems answer, some of them over a network, that cannot write out a folder."""


def _refusal(place: Path, error: OSError) -> OutputError:
    reason = f"{place}: cannot write here: {error.strerror or error}"
    for advice, codes in _ADVICE.items():
        if error.errno in codes:
            return DiskError(f"{reason}; {advice}: what is finished is kept.")
    return OutputError(f"{reason}.")


@contextmanager
def writing_to(place: Path) -> Iterator[None]:
    """Turn what the system refuses into an error that names the place.

    Parameters
    ----------
    place : Path
        What is to be written, as the user knows it.

    Raises
    ------
    DiskError
        If the disk or the folder refuses: full, gone, not writable.
    OutputError
        If it is something else that is refused, or the place's name is not UTF-8.
    """
    try:
        str(place).encode()
    except UnicodeEncodeError:
        raise OutputError(
            f"{str(place)!a}: this name is not valid UTF-8 and cannot be shown; choose another."
        ) from None
    try:
        yield
    except OSError as error:
        raise _refusal(place, error) from error


def is_there(place: Path) -> bool:
    """Whether something stands at a place.

    Raises
    ------
    OutputError
        If nobody can tell; then nothing can be put there, either.
    """
    with writing_to(place):
        try:
            place.stat()
        except FileNotFoundError:
            return False
    return True


def sync(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk.

    Raises
    ------
    OSError
        If the disk refuses.
    """
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if not (error.errno in _NO_SYNC and path.is_dir()):
            raise
    finally:
        os.close(descriptor)


def sync_tree(path: Path) -> None:
    """`sync` a file, or a folder and all that is in it."""
    if path.is_dir():
        for each in path.iterdir():
            sync_tree(each)
    sync(path)


def make_folder(folder: Path) -> None:
    """Make a folder and those above it that are missing, and see to it that they stay.

    Raises
    ------
    OSError
        If the disk refuses.
    """
    if not folder.exists():
        make_folder(folder.parent)
        folder.mkdir(exist_ok=True)
        sync(folder.parent)


def remove(path: Path) -> None:
    """Delete a file or a folder, if it is there and as far as the disk allows it."""
    with suppress(OSError):
        path.unlink()
    shutil.rmtree(path, ignore_errors=True)
