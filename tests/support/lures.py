"""Files that would have FFmpeg open something else: another file, or an address."""

import struct
from collections.abc import Callable
from pathlib import Path

from support.media import write_video

__all__ = ["LURES"]


def _playlist(path: Path, target: str) -> None:
    head = "#EXTM3U\n#EXT-X-VERSION:3\n#EXT-X-TARGETDURATION:5\n"
    path.write_text(f"{head}#EXTINF:5,\n{target}\n#EXT-X-ENDLIST\n")


def _script(path: Path, target: str) -> None:
    path.write_text(f"ffconcat version 1.0\nfile '{target}'\n")


def _presentation(path: Path, target: str) -> None:
    path.write_text(
        '<?xml version="1.0"?><MPD xmlns="urn:mpeg:dash:schema:mpd:2011" type="static" '
        'mediaPresentationDuration="PT2S" minBufferTime="PT1S" '
        'profiles="urn:mpeg:dash:profile:isoff-on-demand:2011"><Period><AdaptationSet '
        'mimeType="video/mp2t"><Representation id="1" bandwidth="1000">'
        f"<BaseURL>{target}</BaseURL></Representation></AdaptationSet></Period></MPD>\n"
    )


def _session(path: Path, target: str) -> None:
    del target  # sessions are listened to
    path.write_text("v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nt=0 0\nm=video 5004 RTP/AVP 26\n")


def _movie(path: Path, target: str) -> None:
    """Write a QuickTime movie whose pictures are, as it says, in another file."""
    content = bytearray(write_video(path).read_bytes())
    place = content.index(b"dref") - 4
    (old,) = struct.unpack_from(">I", content, place)
    alias = _alias(target)
    entries = struct.pack(">I4sII", 16 + len(alias), b"dref", 0, 1) + alias
    content[place : place + old] = entries
    for box in (b"moov", b"trak", b"mdia", b"minf", b"dinf"):
        start = content.index(box) - 4
        (size,) = struct.unpack_from(">I", content, start)
        struct.pack_into(">I", content, start, size + len(entries) - old)
    path.write_bytes(content)


def _alias(target: str) -> bytes:
    """Say where a file is, as the Macintosh did."""
    name, place = Path(target).name.encode(), target.replace("/", ":").encode()
    head = bytes(50) + bytes([len(name)]) + name.ljust(63, b"\0") + bytes(16)
    levels = struct.pack(">HH", 1, 1) + bytes(16)
    whole_path = struct.pack(">HH", 2, len(place)) + place + bytes(len(place) % 2)
    record = head + levels + whole_path + struct.pack(">HH", 0xFFFF, 0)
    return struct.pack(">I4sI", 12 + len(record), b"alis", 0) + record


LURES: dict[str, Callable[[Path, str], None]] = {
    "playlist.m3u8": _playlist,
    "playlist.mp4": _playlist,
    "script.ffconcat": _script,
    "script.mp4": _script,
    "presentation.mpd": _presentation,
    "session.sdp": _session,
    "movie.mov": _movie,
}
"""By name of the file: writes it to a path, with the path or address of what it leads to."""
