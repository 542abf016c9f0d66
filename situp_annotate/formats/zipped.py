"""Files that come alone or in a zip archive, read in the same way."""

import lzma
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from situp_annotate.errors import SitupError

__all__ = ["Readable", "opened", "read_text", "zipped_names"]

Readable = Path | zipfile.Path
"""A file on disk or in an archive."""

_BROKEN = (zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError, NotImplementedError)


def zipped_names(path: Path) -> frozenset[str]:
    """Names in a zip archive; none if the file is no such archive, or broken."""
    try:
        with zipfile.ZipFile(path) as archive:
            return frozenset(archive.namelist())
    except (*_BROKEN, OSError, ValueError):
        return frozenset()


def _member(archive: zipfile.ZipFile, path: Path, name: str) -> zipfile.Path:
    if name not in archive.namelist():
        raise SitupError(f"{path}: there is no {name} in this archive; give one that has it.")
    if any(info.flag_bits & 1 for info in archive.infolist()):
        raise SitupError(f"{path}: this archive is locked by a password; unpack it first.")
    return zipfile.Path(archive, name)


@contextmanager
def opened(path: Path, member: str) -> Iterator[Readable]:
    """Give a file itself or, if it is a zip archive, one that is in it.

    Parameters
    ----------
    path : Path
        A file of any kind.
    member : str
        Name of the file to take from an archive.

    Raises
    ------
    SitupError
        If an archive is broken or has no such member, or a file cannot be read, then or later in
        the ``with`` block.
    """
    try:
        if zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as archive:
                yield _member(archive, path, member)
        else:
            yield path
    except _BROKEN as error:
        raise SitupError(f"{path}: this archive is broken ({error}); make it again.") from error
    except OSError as error:
        raise SitupError(f"{path}: cannot be read: {error.strerror or error}.") from error


def read_text(file: Readable) -> str:
    """Read a text file (UTF-8) whole.

    Raises
    ------
    SitupError
        If it cannot be read, or is no text.
    """
    try:
        return file.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise SitupError(f"{file}: cannot be read as a text file: {error}.") from error
