"""Decoding with PyAV, for streams that OpenCV cannot decode, or not with a bound on memory."""

from collections.abc import Generator
from pathlib import Path

import av
from av.video.frame import VideoFrame

from situp_annotate.errors import VideoIncompleteError
from situp_annotate.types import Image
from situp_annotate.video.bounds import too_large
from situp_annotate.video.probe import ticks_to_ns
from situp_annotate.video.pyav_stream import (
    decode_packet,
    open_stream,
    read_packets,
    refuses_size,
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
    max_pixels : int
        How large a picture may be.
    """

    name = "pyav"

    def __init__(self, path: Path, *, grey: bool, max_pixels: int) -> None:
        self.rotation_degrees = 0
        self._path = path
        self._grey = grey
        self._max_pixels = max_pixels
        self._container, self._stream = open_stream(path, max_pixels=max_pixels)
        self._frames = self._decode()
        self._frame: VideoFrame | None = None

    def _decode(self) -> Generator[VideoFrame]:
        context = self._stream.codec_context
        for packet in read_packets(self._container, self._stream):
            had_size = context.width > 0
            frames = decode_packet(packet)
            if had_size and refuses_size(context, self._max_pixels):
                size_hw = context.height, context.width
                raise too_large(self._path, "a picture", size_hw, self._max_pixels)
            yield from frames

    def advance(self) -> bool:
        """Go to the next picture.

        Raises
        ------
        VideoTooLargeError
            If one has too many pixels.
        """
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
        turn = self.rotation_degrees
        try:
            return upright_image(self._current, grey=self._grey, rotation_degrees=turn)
        except av.FFmpegError as error:
            raise VideoIncompleteError(
                f"{self._path}: a picture decodes but cannot be converted to colours "
                f"({error.strerror}); convert the video, for instance to H.264."
            ) from error

    def close(self) -> None:
        """Free the file."""
        self._frames.close()
        self._container.close()
