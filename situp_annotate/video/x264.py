"""What everything that encodes with x264 shares: pictures out of BGR, and the encoder's basics."""

from fractions import Fraction

import av
import cv2
import numpy as np
import numpy.typing as npt
from av.video.codeccontext import VideoCodecContext
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc

from situp_annotate.types import NS_PER_S, Image

__all__ = ["TICKS_PER_SECOND", "set_up_encoder", "ticks", "yuv_frame"]

TICKS_PER_SECOND = 90_000
"""Of the times that frames are encoded with."""


def set_up_encoder(context: VideoCodecContext, *, width: int, height: int) -> None:
    """Set size, clock and colours of an x264 encoder that is not open yet.

    One thread, so that the same frames give the same bytes. Sizes are made even, which yuv420p
    demands.
    """
    context.width, context.height = width + width % 2, height + height % 2
    context.pix_fmt = "yuv420p"
    context.time_base = Fraction(1, TICKS_PER_SECOND)
    context.thread_count = 1
    # Untagged, browsers guess the matrix by the picture's size and shift the colours.
    context.colorspace, context.color_range = Colorspace.ITU709, ColorRange.MPEG
    context.color_primaries, context.color_trc = ColorPrimaries.BT709, ColorTrc.BT709


def _bt709() -> npt.NDArray[np.float64]:
    """(3, 4): from B, G, R and 1 to Y in 16–235 and U, V in 16–240; BT.709-6, items 3.2 to 3.5."""
    luma = np.array([0.0722, 0.7152, 0.2126])
    blue, _, red = np.eye(3)
    rows = [
        219 / 255 * luma,
        224 / 255 * (blue - luma) / (2 * (1 - luma[0])),
        224 / 255 * (red - luma) / (2 * (1 - luma[2])),
    ]
    return np.column_stack([rows, [16, 128, 128]])


_BT709 = _bt709()


def yuv_frame(image: Image) -> av.VideoFrame:
    """Convert a picture to yuv420p of BT.709, chroma being the mean of 2 × 2 pixels.

    In a third of the time that FFmpeg's scaler takes.

    Parameters
    ----------
    image : Image
        (h, w) grey, or (h, w, 3) in the order B, G, R. Where a side is odd, the last row or
        column is repeated.
    """
    color = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image
    height, width = image.shape[:2]
    if height % 2 or width % 2:
        color = cv2.copyMakeBorder(color, 0, height % 2, 0, width % 2, cv2.BORDER_REPLICATE)
        height, width = color.shape[:2]
    yuv = cv2.transform(color, _BT709)
    half = cv2.resize(yuv, (width // 2, height // 2), interpolation=cv2.INTER_AREA)
    frame = av.VideoFrame(width, height, "yuv420p")
    for channel, (plane, source) in enumerate(zip(frame.planes, (yuv, half, half), strict=True)):
        rows = np.frombuffer(memoryview(plane), np.uint8).reshape(-1, plane.line_size)
        rows[: plane.height, : plane.width] = source[..., channel]
    frame.colorspace, frame.color_range = Colorspace.ITU709, ColorRange.MPEG
    return frame


def ticks(time_ns: int) -> int:
    """Turn nanoseconds into ticks, rounded."""
    return round(time_ns * TICKS_PER_SECOND / NS_PER_S)
