"""Find the videos below a folder, and tell one video from another by its content."""

import hashlib
import os
from collections.abc import Iterator
from pathlib import Path

from situp_annotate.errors import VideoFormatError, VideoMissingError
from situp_annotate.video.image_folder import list_images, natural_key

__all__ = ["VIDEO_SUFFIXES", "find_videos", "fingerprint"]

VIDEO_SUFFIXES = frozenset(
    f".{name}"
    for name in (
        *("3gp", "asf", "avi", "flv", "h264", "h265", "hevc", "m2ts", "m4v", "mkv", "mov", "mp4"),
        *("mpeg", "mpg", "mts", "mxf", "ogv", "ts", "webm", "wmv"),
    )
)


def _walk(folder: Path) -> Iterator[Path]:
    entries = [entry for entry in folder.iterdir() if not entry.name.startswith(".")]
    videos = [path for path in entries if path.suffix.lower() in VIDEO_SUFFIXES and path.is_file()]
    # Beside video files pictures are previews and the like.
    if not videos and list_images(folder):
        yield folder
        return
    yield from videos
    for entry in entries:
        if entry.is_dir() and not entry.is_symlink():
            yield from _walk(entry)


def find_videos(folder: Path) -> list[Path]:
    """List the videos in a folder and the folders below it.

    A folder of pictures, or one with pictures in its ``img`` (OTB's layout), is one video and is
    not searched further. Names that start with a dot and links to folders are passed over.

    Parameters
    ----------
    folder : Path
        Where to look.

    Returns
    -------
    list of Path
        Video files (by their suffix) and folders of pictures, in natural order: ``2`` before
        ``10``.

    Raises
    ------
    VideoMissingError
        If the folder is not there or cannot be read.
    VideoFormatError
        If it is no folder.
    """
    if folder.is_file():
        raise VideoFormatError(f"{folder}: a file; name the folder that holds the videos.")
    try:
        found = list(_walk(folder))
    except OSError as error:
        raise VideoMissingError(
            f"{folder}: the folder cannot be read ({error.strerror}); correct the path or its "
            "permissions."
        ) from error
    names = {path: path.relative_to(folder).parts for path in found}
    return sorted(found, key=lambda path: ([natural_key(part) for part in names[path]], path))


def fingerprint(path: Path) -> str:
    """Hash a video's content, so that a result can name the video it was made from.

    Parameters
    ----------
    path : Path
        A video file, or a folder of pictures.

    Returns
    -------
    str
        SHA-256 in hexadecimal: of the file's bytes; of a folder, over each picture's name and
        the hash of its bytes, sorted by name. What is no file, such as a link that leads nowhere,
        counts as an empty one.

    Raises
    ------
    VideoMissingError
        If it is not there or cannot be read.
    VideoFormatError
        If it is a folder without pictures, or neither a file nor a folder.
    """
    try:
        if not path.is_dir():
            if path.exists() and not path.is_file():
                raise VideoFormatError(
                    f"{path}: neither a file nor a folder but a pipe, a socket or a device; name "
                    "a video."
                )
            return _hash_file(path).hexdigest()
        images = sorted((image.relative_to(path).as_posix(), image) for image in list_images(path))
        if not images:
            raise VideoFormatError(f"{path}: the folder holds no pictures; name a video.")
        total = hashlib.sha256()
        for name, image in images:
            content = _hash_file(image) if image.is_file() else hashlib.sha256()
            total.update(os.fsencode(name) + b"\0" + content.digest())
        return total.hexdigest()
    except OSError as error:
        raise VideoMissingError(
            f"{path}: the video cannot be read ({error.strerror}); correct the path or its "
            "permissions."
        ) from error


def _hash_file(path: Path) -> "hashlib._Hash":
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256")
