"""Outputs appear whole or not at all: made beside their place, moved there when done."""

import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from fnmatch import fnmatchcase
from pathlib import Path

from situp_annotate.errors import OutputError

__all__ = [
    "discard_staging",
    "refuse_existing",
    "refuse_foreign",
    "staged_entries",
    "staged_folder",
    "write_whole",
]


def refuse_existing(places: Iterable[Path], *, overwrite: bool) -> None:
    """Stop before anything is made that would replace what is there, unless that is wanted.

    Raises
    ------
    OutputError
        If something is at one of the places and must not be replaced.
    """
    present = [] if overwrite else [place for place in places if place.exists()]
    if present:
        more = f" and {len(present) - 1} more" if len(present) > 1 else ""
        raise OutputError(
            f"{present[0]}{more}: this is already there; replace it with --overwrite, or choose "
            "another place with --output."
        )


def _beside(target: Path, suffix: str) -> Path:
    """A hidden place beside a target, even one that is given as ``.``."""
    whole = target.absolute()
    return whole.parent / f".{whole.name}.{suffix}"


def discard_staging(target: Path) -> None:
    """Remove what an interrupted :func:`staged_folder` of this target left behind."""
    shutil.rmtree(_beside(target, "partial"), ignore_errors=True)


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def refuse_foreign(target: Path, replaceable: frozenset[str]) -> None:
    """Stop before replacing a folder would take along what somebody else put there.

    Raises
    ------
    OutputError
        If the folder holds anything but `replaceable`, as of `staged_folder`.
    """
    for name in sorted(path.name for path in target.iterdir()):
        if not any(fnmatchcase(name, each) for each in replaceable):
            raise OutputError(
                f"{target}: this folder holds {name!r}, which is not to be replaced; move it "
                f"away, or choose another output folder."
            )


@contextmanager
def staged_folder(target: Path, *, replaceable: frozenset[str] | None) -> Iterator[Path]:
    """Make a folder whole or not at all.

    Parameters
    ----------
    target : Path
        The folder to make.
    replaceable : frozenset of str or None
        None when the folder must not be there yet; else the names, or patterns such as
        ``*.png``, of all that a folder standing there may hold to be replaced.

    Yields
    ------
    Path
        A hidden folder beside the target to write into. Leaving normally puts it in the
        target's place; leaving by an exception removes it.

    Raises
    ------
    OutputError
        If the target is there and must not be replaced, or the disk refuses.
    """
    staging = _beside(target, "partial")
    try:
        if target.exists():
            if replaceable is None:
                raise OutputError(
                    f"{target}: this output is already there; replace it with --overwrite, or "
                    f"choose another output folder."
                )
            refuse_foreign(target, replaceable)
        shutil.rmtree(staging, ignore_errors=True)
        staging.mkdir(parents=True)
        yield staging
        _publish(staging, target)
    except OSError as error:
        raise OutputError(f"{target}: cannot write here: {error.strerror or error}.") from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _publish(staging: Path, target: Path) -> None:
    for path in staging.iterdir():
        _sync(path)
    _sync(staging)
    if target.exists():
        old = _beside(target, "old")
        shutil.rmtree(old, ignore_errors=True)
        target.rename(old)
        staging.rename(target)
        shutil.rmtree(old, ignore_errors=True)
    else:
        staging.rename(target)
    _sync(target.parent)


@contextmanager
def staged_entries(target: Path, *, overwrite: bool) -> Iterator[Path]:
    """Put files and folders into a folder, each whole or not at all.

    Parameters
    ----------
    target : Path
        The folder to put them into; made when missing.
    overwrite : bool
        Whether the folder may hold something already. Then what has the name of something new
        is replaced, a file by a file and a folder by a folder, and everything else stays.

    Yields
    ------
    Path
        A hidden, empty folder beside the target to write into.

    Raises
    ------
    OutputError
        If the folder holds something and must not, or the disk refuses.
    """
    staging = _beside(target, "partial")
    try:
        if not overwrite and target.exists() and (target.is_file() or any(target.iterdir())):
            raise OutputError(
                f"{target}: something is there already; replace it with --overwrite, or choose "
                f"another output folder."
            )
        shutil.rmtree(staging, ignore_errors=True)
        staging.mkdir(parents=True)
        yield staging
        target.mkdir(exist_ok=True)
        for entry in sorted(staging.iterdir()):
            _publish_entry(entry, target / entry.name)
        _sync(target)
    except OSError as error:
        raise OutputError(f"{target}: cannot write here: {error.strerror or error}.") from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _publish_entry(entry: Path, place: Path) -> None:
    _sync(entry)
    if entry.is_dir() and place.is_dir() and not place.is_symlink():
        old = _beside(place, "old")
        shutil.rmtree(old, ignore_errors=True)
        place.rename(old)
        entry.rename(place)
        shutil.rmtree(old, ignore_errors=True)
    else:
        entry.replace(place)


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file, text as UTF-8, whole or not at all, replacing one that stands there.

    Raises
    ------
    OutputError
        If the disk refuses.
    """
    partial = _beside(path, "partial")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.write_bytes(content.encode() if isinstance(content, str) else content)
        _sync(partial)
        partial.replace(path)
    except OSError as error:
        with suppress(OSError):
            partial.unlink()
        raise OutputError(f"{path}: cannot write here: {error.strerror or error}.") from error
