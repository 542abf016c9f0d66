"""Decoding with PyAV, for streams that OpenCV's FFmpeg opens and cannot decode."""

from collections.abc import Generator
from pathlib import Path

from av.video.frame import VideoFrame

from situp_annotate.types import Image
from situp_annotate.video.probe import ticks_to_ns
from situp_annotate.video.pyav_stream import (
    decode_packet,
    open_stream,
    read_packets,
    upright_image,
)

__all__ = ["PyAvDecoder"]


class PyAvDecoder:
    """One stream read from its start with PyAV, one thread, past packets that are broken.

    Parameters
    ----------
    path : Path
        An absolute path: FFmpeg reads ``name:rest`` as a protocol otherwise.
    grey : bool
        Whether the stream is grey.
    """

    name = "pyav"

    def __init__(self, path: Path, *, grey: bool) -> None:
        self.rotation_degrees = 0
        self._grey = grey
        self._container, self._stream = open_stream(path)
        self._frames = self._decode()
        self._frame: VideoFrame | None = None

    def _decode(self) -> Generator[VideoFrame]:
        for packet in read_packets(self._container, self._stream):
            yield from decode_packet(packet)

    def advance(self) -> bool:
        """Go to the next picture."""
        self._frame = next(self._frames, None)
        if self._frame is None:
            return False
        self.rotation_degrees = -self._frame.rotation % 360  # PyAV counts anticlockwise
        return True

    @property
    def _current(self) -> VideoFrame:
        assert self._frame is not None, "advance() found a picture"
        return self._frame

    @property
    def time_ns(self) -> int | None:
        """Time of this picture from the start of the stream; None when it carries none."""
        pts, time_base = self._current.pts, self._current.time_base
        if pts is None or time_base is None:
            return None
        return ticks_to_ns(pts - (self._stream.start_time or 0), time_base)

    @property
    def size_hw(self) -> tuple[int, int]:
        """Height and width of this picture in pixels, upright."""
        height, width = self._current.height, self._current.width
        return (width, height) if self.rotation_degrees % 180 else (height, width)

    def image(self) -> Image:
        """Return this picture, upright: (h, w) from a grey stream, else (h, w, 3) as B, G, R."""
        return upright_image(self._current, grey=self._grey, rotation_degrees=self.rotation_degrees)

    def close(self) -> None:
        """Free the file."""
        self._frames.close()
        self._container.close()
