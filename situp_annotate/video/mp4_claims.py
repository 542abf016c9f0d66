"""How many pictures an mp4 claims to hold, before FFmpeg sets aside memory for each of them."""

import os
import struct
from collections.abc import Iterator
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import BinaryIO, TypeAlias

__all__ = ["claimed_pictures"]

_Span: TypeAlias = tuple[int, int]

_MAX_BOXES = 10_000  # beside one another; other files than mp4 seem to have many small ones


def claimed_pictures(path: Path) -> int:
    """Read from an mp4's index how many pictures of one and the same size it claims.

    A count of pictures with sizes of their own cannot lie by much: the sizes have to be there.

    Parameters
    ----------
    path : Path
        A file of any kind, or none.

    Returns
    -------
    int
        Of the track that claims most; 0 where nothing is claimed or can be read.

    References
    ----------
    ISO/IEC 14496-12, 8.7.3: sample size boxes.
    """
    if not path.is_file():
        return 0
    with suppress(OSError), path.open("rb") as file:
        whole = 0, os.fstat(file.fileno()).st_size
        media = _boxes_at(file, whole, (b"moov", b"trak", b"mdia"))
        return max((_claim(file, span) for span in media if _is_video(file, span)), default=0)
    return 0


def _is_video(file: BinaryIO, media: _Span) -> bool:
    handlers = (_read(file, span, 8, 4) for span in _boxes_at(file, media, (b"hdlr",)))
    return b"vide" in handlers


def _claim(file: BinaryIO, media: _Span) -> int:
    most = 0
    for span in _boxes_at(file, media, (b"minf", b"stbl", b"stsz")):
        content = _read(file, span, 4, 8)
        size, count = struct.unpack(">II", content) if len(content) == 8 else (0, 0)
        most = max(most, count if size else 0)
    return most


def _boxes_at(file: BinaryIO, span: _Span, kinds: tuple[bytes, ...]) -> Iterator[_Span]:
    """Contents of the boxes with the last of these kinds, in boxes of the others."""
    for kind, inner in islice(_boxes(file, span), _MAX_BOXES):
        if kind == kinds[0]:
            yield from _boxes_at(file, inner, kinds[1:]) if kinds[1:] else (inner,)


def _boxes(file: BinaryIO, span: _Span) -> Iterator[tuple[bytes, _Span]]:
    start, stop = span
    while start < stop:
        header = _read(file, (start, stop), 0, 16).ljust(16, b"\0")
        size, kind, large_size = struct.unpack(">I4sQ", header)
        head = 8
        if size == 1:
            size, head = large_size, 16
        size = size or stop - start
        if size < head:
            return
        end = min(start + size, stop)
        yield kind, (start + head, end)
        start = end


def _read(file: BinaryIO, span: _Span, offset: int, count: int) -> bytes:
    start, stop = span
    file.seek(start + offset)
    return file.read(max(0, min(count, stop - start - offset)))
