"""Ids of videos: what is safe as the name of an output folder, and which id a path gives.

An id that the user leaves out follows from the path alone, so that a video keeps its output
folder whatever else enters or leaves the manifest.
"""

import unicodedata
from collections.abc import Iterable
from pathlib import Path, PurePosixPath

__all__ = ["comparable_id", "default_id", "is_safe_id", "unique_ids"]

MAX_ID_CHARACTERS = 100
MAX_ID_BYTES = 200  # file systems stop at 255 bytes, and work files add to the name
RESERVED_IDS = frozenset(
    {"batch.json", "logs", "report.html"}
)  # stand beside the folders of the videos
PICTURE_FOLDER = "img"  # where sequences in OTB layout keep their frames


def comparable_id(video_id: str) -> str:
    """Return the form in which file systems that ignore case compare two names."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", video_id).casefold())


def _is_safe_character(character: str) -> bool:
    # Unicode's categories of control characters, surrogates, and what else ends a line.
    return character not in "/\\" and unicodedata.category(character) not in (
        "Cc",
        "Cs",
        "Zl",
        "Zp",
    )


def is_safe_id(video_id: str) -> bool:
    """Whether the id can name a folder anywhere: one path component, visible, not too long."""
    return (
        video_id == video_id.strip()
        and not video_id.startswith(".")
        and 1 <= len(video_id) <= MAX_ID_CHARACTERS
        and all(map(_is_safe_character, video_id))
        and len(video_id.encode()) <= MAX_ID_BYTES
        and comparable_id(video_id) not in RESERVED_IDS
    )


def _shortened(video_id: str, characters: int = MAX_ID_CHARACTERS) -> str:
    # The end of a path tells more than its beginning.
    kept = video_id[-characters:]
    while len(kept.encode()) > MAX_ID_BYTES:
        kept = kept[1:]
    return kept


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:  # a name that is too long, or a folder that may not be looked into
        return False


def default_id(path: str, folder: Path) -> str:
    """Return the id of a video whose manifest entry gives none.

    It is the path without its suffix, folders joined by hyphens: ``clips/street.mp4`` becomes
    ``clips-street``. A folder of pictures gives its whole name, without a closing ``img``:
    ``Car4/img`` becomes ``Car4``.

    Parameters
    ----------
    path : str
        As it stands in the manifest.
    folder : Path
        Where the manifest lies; tells files from folders, and names the path ``"."``.
    """
    pure = PurePosixPath(path)
    is_folder = _is_folder(folder / path)
    if pure.suffix and not is_folder:
        pure = pure.with_suffix("")
    parts = [part for part in pure.parts if part not in ("/", "//", "..")]
    if is_folder and len(parts) > 1 and parts[-1] == PICTURE_FOLDER:
        parts.pop()
    name = "-".join(parts) or (folder / path).resolve().name
    safe = "".join(c if _is_safe_character(c) else "-" for c in name)
    candidate = _shortened(safe).strip().lstrip(". ")
    return candidate if is_safe_id(candidate) else _shortened(f"video-{candidate}", 90)


def unique_ids(paths: Iterable[str], folder: Path) -> list[str]:
    """Return the default id of each path, with ``-2``, ``-3``, … where two would be the same."""
    taken: set[str] = set()
    ids = []
    for path in paths:
        wanted = default_id(path, folder)
        candidate, number = wanted, 1
        while comparable_id(candidate) in taken:
            number += 1
            ending = f"-{number}"
            candidate = _shortened(wanted, MAX_ID_CHARACTERS - len(ending)).lstrip(". ") + ending
        taken.add(comparable_id(candidate))
        ids.append(candidate)
    return ids
