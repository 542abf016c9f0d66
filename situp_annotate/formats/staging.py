"""Outputs appear whole or not at all: made beside their place, moved there when done."""

import hashlib
import os
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from fnmatch import fnmatchcase
from pathlib import Path

from situp_annotate.errors import OutputError
from situp_annotate.formats.disk import (
    is_there,
    make_folder,
    remove,
    sync,
    sync_tree,
    writing_to,
)

__all__ = [
    "discard_staging",
    "hidden_beside",
    "recover_staging",
    "refuse_existing",
    "refuse_foreign",
    "staged_entries",
    "staged_folder",
    "write_whole",
]

_PARTIAL, _OLD = "partial", "old"

_MOST_BYTES = 255
"""Of a file's name, on most file systems."""


def refuse_existing(places: Iterable[Path], *, overwrite: bool) -> None:
    """Stop before anything is made that would replace what is there, unless that is wanted.

    Raises
    ------
    OutputError
        If something is at one of the places and must not be replaced, or nothing can be there.
    """
    present = [place for place in places if is_there(place)]
    if present and not overwrite:
        more = f" and {len(present) - 1} more" if len(present) > 1 else ""
        raise OutputError(
            f"{present[0]}{more}: this is already there; replace it with --overwrite, or choose "
            "another place with --output."
        )


def _hidden_name(name: str, suffix: str) -> str:
    hidden = f".{name}.{suffix}"
    if len(os.fsencode(hidden)) <= _MOST_BYTES:
        return hidden
    return f".{hashlib.sha256(os.fsencode(name)).hexdigest()}.{suffix}"


def hidden_beside(target: Path, suffix: str) -> Path:
    """A hidden place beside a target, even one that is given as ``.``."""
    whole = target.absolute()
    return whole.parent / _hidden_name(whole.name, suffix)


def discard_staging(target: Path) -> None:
    """Remove what an interrupted :func:`staged_folder` of this target left behind."""
    with suppress(OSError):
        remove(hidden_beside(target, _PARTIAL))


def recover_staging(folder: Path, names: Collection[str]) -> None:
    """Put in order what runs that were killed have left behind in a folder.

    What was half made is removed. What was about to be replaced is put back, or removed if that
    had been done already.

    Parameters
    ----------
    folder : Path
        Where targets of `staged_folder` and `write_whole` are; nobody else may be at work there.
    names : collection of str
        Names of the targets; nothing else is touched.

    Raises
    ------
    OutputError
        If the folder cannot be read, or something cannot be put back.
    """
    with writing_to(folder):
        if not folder.exists():
            return
        with os.scandir(folder) as entries:
            present = {entry.name for entry in entries}
        for name in names:
            old, partial = _hidden_name(name, _OLD), _hidden_name(name, _PARTIAL)
            if old in present and name not in present:
                (folder / old).rename(folder / name)
                sync(folder)
            elif old in present:
                remove(folder / old)
            if partial in present:
                remove(folder / partial)


def refuse_foreign(target: Path, replaceable: frozenset[str]) -> None:
    """Stop before replacing a folder would take along what somebody else put there.

    Raises
    ------
    OutputError
        If it is no folder, or holds anything but `replaceable`, as of `staged_folder`.
    """
    if not target.is_dir():
        raise OutputError(f"{target}: a file is there; move it away, or choose another place.")
    for name in sorted(path.name for path in target.iterdir()):
        if not any(fnmatchcase(name, each) for each in replaceable):
            raise OutputError(
                f"{target}: this folder holds {name!r}, which is not to be replaced; move it "
                f"away, or choose another output folder."
            )


@contextmanager
def _staging(target: Path) -> Iterator[Path]:
    """A new hidden folder beside a target, gone in the end."""
    staging = hidden_beside(target, _PARTIAL)
    remove(staging)
    try:
        make_folder(staging)
        yield staging
    finally:
        remove(staging)


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
        A hidden folder beside the target to write into; an ``OSError`` in doing so becomes one
        of those below. Leaving normally puts it in the target's place; leaving by an exception
        removes it.

    Raises
    ------
    OutputError
        If the target is there and must not be replaced, or as of `writing_to`.
    """
    with writing_to(target):
        if target.exists():
            if replaceable is None:
                raise OutputError(
                    f"{target}: this output is already there; replace it with --overwrite, or "
                    f"choose another output folder."
                )
            refuse_foreign(target, replaceable)
        with _staging(target) as staging:
            yield staging
            sync_tree(staging)
            _publish(staging, target)


def _publish(folder: Path, target: Path) -> None:
    """Put a folder in its place; one that stands there gives way."""
    old = hidden_beside(target, _OLD)
    replaces = target.exists()
    if replaces:
        remove(old)
    try:
        if replaces:
            target.rename(old)
        folder.rename(target)
    except BaseException:
        if replaces and not target.exists():
            with suppress(OSError):
                old.rename(target)
        raise
    sync(target.parent)
    remove(old)


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
        A hidden, empty folder beside the target to write into, as of `staged_folder`.

    Raises
    ------
    OutputError
        If the folder holds something and must not, or as of `writing_to`.
    """
    with writing_to(target):
        if not overwrite and target.exists() and (target.is_file() or any(target.iterdir())):
            raise OutputError(
                f"{target}: something is there already; replace it with --overwrite, or choose "
                f"another output folder."
            )
        with _staging(target) as staging:
            yield staging
            sync_tree(staging)
            make_folder(target)
            for entry in sorted(staging.iterdir()):
                _publish_entry(entry, target / entry.name)
            sync(target)


def _publish_entry(entry: Path, place: Path) -> None:
    if entry.is_dir() and not place.is_symlink() and not place.is_file():
        _publish(entry, place)
    else:
        entry.replace(place)


def _pieces(content: str | bytes | Iterable[str]) -> Iterable[bytes]:
    if isinstance(content, bytes):
        return (content,)
    return (piece.encode() for piece in ((content,) if isinstance(content, str) else content))


def write_whole(path: Path, content: str | bytes | Iterable[str]) -> None:
    """Write a file, text as UTF-8, whole or not at all, replacing one that stands there.

    Parameters
    ----------
    path : Path
        The file; its folder is made when missing.
    content : str, bytes or iterable of str
        All of it, or its pieces, of which one is held at a time.

    Raises
    ------
    OutputError
        As of `writing_to`.
    """
    with writing_to(path):
        partial = hidden_beside(path, _PARTIAL)
        make_folder(partial.parent)
        try:
            with partial.open("wb") as file:
                file.writelines(_pieces(content))
            sync(partial)
            partial.replace(path)
            sync(partial.parent)
        finally:
            with suppress(OSError):
                partial.unlink()
