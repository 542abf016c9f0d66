"""H.264 video out, with the true time of every frame."""

from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Self

import av
import numpy as np
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc

from situp_annotate.errors import OutputError
from situp_annotate.types import NS_PER_S, Image

__all__ = ["H264Writer"]

_TICKS_PER_SECOND = 90_000


class H264Writer:
    """Writes an mp4 that plays in browsers: H.264, yuv420p, index in front (faststart).

    One encoder thread, so that the same frames give the same bytes. Pictures of odd size are
    made even by repeating the last row or column, which yuv420p demands.

    Parameters
    ----------
    path : Path
        File to write.
    width, height : int
        Size of the pictures.
    frame_rate : Fraction
        Average; only a hint to the encoder.
    crf : int
        Quality from 1 (best) to 51 (worst); 0 would be lossless, which browsers cannot play.
    preset : str
        x264's trade of speed for size, such as ``"superfast"``.
    pixel_aspect_ratio : Fraction
        Width of a pixel over its height.
    """

    def __init__(
        self,
        path: Path,
        *,
        width: int,
        height: int,
        frame_rate: Fraction,
        crf: int = 23,
        preset: str = "superfast",
        pixel_aspect_ratio: Fraction = Fraction(1),
    ) -> None:
        self._path = path
        self._padding = (height % 2, width % 2)
        self._container = av.open(
            str(path), "w", format="mp4", container_options={"movflags": "+faststart"}
        )
        self._stream = self._container.add_stream(
            "libx264",
            rate=frame_rate.limit_denominator(100_000),
            options={"crf": str(crf), "preset": preset},
        )
        self._stream.width, self._stream.height = width + width % 2, height + height % 2
        self._stream.pix_fmt = "yuv420p"
        context = self._stream.codec_context
        context.time_base = Fraction(1, _TICKS_PER_SECOND)
        context.thread_count = 1
        context.sample_aspect_ratio = pixel_aspect_ratio
        # Untagged, browsers guess the matrix by the picture's size and shift the colours.
        context.colorspace, context.color_range = Colorspace.ITU709, ColorRange.MPEG
        context.color_primaries, context.color_trc = ColorPrimaries.BT709, ColorTrc.BT709
        self._last_tick = -1
        self._usual_ticks = max(round(_TICKS_PER_SECOND / frame_rate), 1)

    def write(self, image: Image, pts_ns: int) -> None:
        """Add a picture, (height, width) or (height, width, 3) in the order B, G, R.

        Parameters
        ----------
        image : Image
            The picture.
        pts_ns : int
            Its time in nanoseconds, later than the one before; kept to 1/90000 s.
        """
        pixels = np.ascontiguousarray(image)
        if any(self._padding):
            margins = [(0, self._padding[0]), (0, self._padding[1]), (0, 0)]
            pixels = np.pad(pixels, margins[: image.ndim], mode="edge")
        frame = av.VideoFrame.from_ndarray(pixels, format="gray" if image.ndim == 2 else "bgr24")
        frame = frame.reformat(
            format="yuv420p",
            dst_colorspace=Colorspace.ITU709,
            dst_color_range=ColorRange.MPEG,
            threads=1,
        )
        tick = max(round(pts_ns * _TICKS_PER_SECOND / NS_PER_S), self._last_tick + 1)
        self._last_tick = tick
        frame.pts, frame.time_base = tick, Fraction(1, _TICKS_PER_SECOND)
        frame.duration = self._usual_ticks
        self._encode(frame)

    def _encode(self, frame: av.VideoFrame | None) -> None:
        try:
            self._container.mux(self._stream.encode(frame))
        except av.FFmpegError as error:
            raise OutputError(f"{self._path}: cannot write the video: {error.strerror}.") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if exc_type is None:
            self._encode(None)
        try:
            self._container.close()
        except av.FFmpegError as error:
            if exc_type is None:
                raise OutputError(
                    f"{self._path}: cannot finish the video: {error.strerror}."
                ) from error
