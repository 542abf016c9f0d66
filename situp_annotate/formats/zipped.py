"""Files that come alone or in a zip archive, read in the same way and never without a limit."""

import posixpath
import stat
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TypeAlias

from situp_annotate.errors import SitupError

__all__ = [
    "MAX_LABEL_BYTES",
    "Member",
    "Readable",
    "beside",
    "is_file",
    "open_archive",
    "open_readable",
    "open_regular",
    "opened",
    "read_text",
    "zipped_names",
]

MAX_LABEL_BYTES = 256 * 2**20
"""Of a file that is read whole, unpacked: archives can promise far more than a computer holds."""

_MAGIC = b"PK"
_PACKED_AS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""What label tools write; others take as much memory to unpack as an archive asks for."""

_BROKEN = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError)
_NO_ARCHIVE = (*_BROKEN, ValueError, OverflowError)
"""What opening an archive, or a file in it, ends in where the lists of files are damaged."""


@dataclass(frozen=True, slots=True)
class Member:
    """A file in a zip archive.

    ``zipfile.Path`` is not used: names with many slashes make it use up all memory.

    Attributes
    ----------
    archive : ZipFile
        Open.
    path : Path
        The archive.
    name : str
        The file's, as the archive has it.
    """

    archive: zipfile.ZipFile
    path: Path
    name: str

    def __str__(self) -> str:
        return f"{self.path}/{self.name}"


Readable: TypeAlias = Path | Member
"""A file on disk or in an archive."""


def open_archive(path: Path) -> zipfile.ZipFile:
    """Open a zip archive.

    Raises
    ------
    SitupError
        If it is none, or broken.
    OSError
        If the file cannot be read.
    """
    try:
        return zipfile.ZipFile(path)
    except _NO_ARCHIVE as error:
        raise _broken(path, error) from error


def _broken(path: Path, error: Exception) -> SitupError:
    return SitupError(f"{path}: this archive is broken ({error}); make it again.")


def zipped_names(path: Path) -> frozenset[str]:
    """Names in a zip archive; none if the file is no such archive, or broken."""
    try:
        with open_archive(path) as archive:
            return frozenset(archive.namelist())
    except (SitupError, OSError):
        return frozenset()


def _checked(member: Member) -> zipfile.ZipInfo:
    try:
        info = member.archive.getinfo(member.name)
    except KeyError:
        raise SitupError(
            f"{member.path}: there is no {member.name} in this archive; give one that has it."
        ) from None
    if info.flag_bits & 1:
        raise SitupError(f"{member.path}: this archive is locked by a password; unpack it first.")
    if info.compress_type not in _PACKED_AS:
        raise SitupError(
            f"{member}: this is packed in a way that is not read; pack it as other tools do "
            "(deflate)."
        )
    return info


def _check_size(file: Readable, size: int) -> None:
    if size > MAX_LABEL_BYTES:
        raise SitupError(
            f"{file}: this has {size / 2**20:.0f} MiB, more than the {MAX_LABEL_BYTES // 2**20} "
            "that a file of labels may have; divide it."
        )


def open_regular(path: Path) -> IO[bytes]:
    """Open a file on disk, but nothing that would be waited for, or never ends.

    Raises
    ------
    SitupError
        If it is a pipe, a socket or a device.
    OSError
        If it cannot be read.
    """
    mode = path.stat().st_mode
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise SitupError(f"{path}: this is a pipe, a socket or a device; give a file.")
    return path.open("rb")


def open_readable(file: Readable) -> IO[bytes]:
    """Open a file to read its bytes.

    Raises
    ------
    SitupError
        If it is too large, or no file, or its archive is broken, locked or without it.
    OSError
        If it cannot be read.
    """
    if isinstance(file, Member):
        info = _checked(file)
        _check_size(file, info.file_size)
        try:
            return file.archive.open(info)
        except _NO_ARCHIVE as error:
            raise _broken(file.path, error) from error
    _check_size(file, file.stat().st_size)
    return open_regular(file)


def is_file(file: Readable) -> bool:
    """Whether such a file is there."""
    if isinstance(file, Member):
        return file.name in file.archive.namelist()
    return file.is_file()


def beside(file: Readable, relative: str) -> Readable:
    """Give what stands around a file, on disk or in the same archive."""
    if isinstance(file, Member):
        name = posixpath.normpath(f"{posixpath.dirname(file.name)}/{relative}")
        return Member(file.archive, file.path, name)
    return file.parent / relative


def _is_archive(path: Path) -> bool:
    with open_regular(path) as file:
        return file.read(len(_MAGIC)) == _MAGIC


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
        if _is_archive(path):
            with open_archive(path) as archive:
                yield Member(archive, path, member)
        else:
            yield path
    except _BROKEN as error:
        raise _broken(path, error) from error
    except OSError as error:
        raise SitupError(f"{path}: cannot be read: {error.strerror or error}.") from error


def read_text(file: Readable) -> str:
    """Read a text file (UTF-8, with or without a byte-order mark) whole.

    Raises
    ------
    SitupError
        If it cannot be read, is too large, or is no text.
    """
    try:
        with open_readable(file) as stream:
            return stream.read().decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise SitupError(f"{file}: cannot be read as a text file: {error}.") from error
