"""Decoding with PyAV, for streams that OpenCV's FFmpeg opens and cannot decode."""

from collections.abc import Generator
from pathlib import Path

import av
import cv2
import numpy as np
from av.video.frame import VideoFrame

from situp_annotate.types import Image
from situp_annotate.video.probe import open_container, ticks_to_ns, video_stream

__all__ = ["PyAvDecoder"]

_TURNS = {
    90: cv2.ROTATE_90_CLOCKWISE,
    180: cv2.ROTATE_180,
    270: cv2.ROTATE_90_COUNTERCLOCKWISE,
}


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
        self._container = open_container(path)
        self._stream = video_stream(self._container, path)
        self._stream.thread_type = "NONE"
        self._stream.codec_context.thread_count = 1
        self._frames = self._decode()
        self._frame: VideoFrame | None = None

    def _decode(self) -> Generator[VideoFrame]:
        packets = self._container.demux(self._stream)
        while True:
            try:
                packet = next(packets)
            except (StopIteration, av.FFmpegError):
                return
            try:
                yield from packet.decode()
            except av.FFmpegError:
                continue  # a broken packet; the source counts what is missing

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
        image = self._current.to_ndarray(format="gray" if self._grey else "bgr24")
        turn = _TURNS.get(self.rotation_degrees)
        upright = image if turn is None else cv2.rotate(image, turn)
        return np.ascontiguousarray(upright, dtype=np.uint8)

    def close(self) -> None:
        """Free the file."""
        self._frames.close()
        self._container.close()
