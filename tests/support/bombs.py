"""Files of a few kilobytes that ask for gigabytes."""

import struct
import zlib
from pathlib import Path

import cv2

from support.media import draw_index, write_video

__all__ = ["write_frame_claim", "write_huge_keyframe", "write_huge_picture"]

_VP8_START_CODE = b"\x9d\x01\x2a"


def write_huge_picture(path: Path, side: int = 20_000) -> Path:
    """Write a picture of so many pixels in width and in height, black or mostly missing."""
    if path.suffix == ".png":
        path.write_bytes(_black_png(side))
        return path
    assert cv2.imwrite(str(path), draw_index(0), [cv2.IMWRITE_WEBP_QUALITY, 80])
    content = bytearray(path.read_bytes())
    if path.suffix == ".jpg":
        place, size = content.index(b"\xff\xc0") + 5, struct.pack(">HH", side, side)
    elif path.suffix == ".bmp":
        place, size = 18, struct.pack("<ii", side, side)
    elif path.suffix == ".webp":
        place = content.index(_VP8_START_CODE) + 3
        size = struct.pack("<HH", min(side, 16383), min(side, 16383))
    else:
        return _enlarge_tiff(path, content, side)
    content[place : place + len(size)] = size
    path.write_bytes(content)
    return path


def _black_png(side: int) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        content = kind + data
        return struct.pack(">I", len(data)) + content + struct.pack(">I", zlib.crc32(content))

    packer = zlib.compressobj(9)
    row = bytes(1 + (side + 7) // 8)
    rows = b"".join(packer.compress(row) for _ in range(side)) + packer.flush()
    header = struct.pack(">IIBBBBB", side, side, 1, 0, 0, 0, 0)  # one bit of grey
    parts = (chunk(b"IHDR", header), chunk(b"IDAT", rows), chunk(b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def _enlarge_tiff(path: Path, content: bytearray, side: int) -> Path:
    (directory,) = struct.unpack_from("<I", content, 4)
    (count,) = struct.unpack_from("<H", content, directory)
    for entry in range(directory + 2, directory + 2 + 12 * count, 12):
        (tag,) = struct.unpack_from("<H", content, entry)
        if tag in (256, 257):  # width and length
            struct.pack_into("<HII", content, entry + 2, 4, 1, side)
    path.write_bytes(content)
    return path


def write_huge_keyframe(path: Path, *, first: int = 0, side: int = 16_000) -> Path:
    """Write VP8 whose keyframes from number `first` on say that they have so many pixels a side."""
    content = bytearray(write_video(path, codec="libvpx").read_bytes())
    places = [place for place in range(len(content)) if content.startswith(_VP8_START_CODE, place)]
    for place in places[first:]:
        content[place + 3 : place + 7] = struct.pack("<HH", side, side)
    path.write_bytes(content)
    return path


def write_frame_claim(path: Path, count: int) -> Path:
    """Write an mp4 of 60 index pictures whose index says that there are so many, of a byte each."""
    content = bytearray(write_video(path).read_bytes())
    claims = {b"stsz": (4, (1, count)), b"stsc": (12, (count,)), b"stts": (8, (count,))}
    for box, (offset, numbers) in claims.items():
        struct.pack_into(f">{len(numbers)}I", content, content.index(box) + 4 + offset, *numbers)
    path.write_bytes(content)
    return path
