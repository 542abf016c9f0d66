"""H.264 picture by picture, for viewers that decode each one as it comes."""

from fractions import Fraction

import av

from situp_annotate.types import Image
from situp_annotate.video.x264 import set_up_encoder, ticks, yuv_frame

__all__ = ["PictureEncoder"]

_KEYFRAME_DISTANCE = 30
"""In frames: as far back as a viewer has to decode from where it is made to jump to."""


class PictureEncoder:
    """Makes one coded picture of each frame: no B-frames, parameter sets before each keyframe.

    Pictures of odd size are made even by repeating the last row or column.

    Parameters
    ----------
    width, height : int
        Size of the pictures.
    frame_rate : Fraction
        Average; only a hint to the encoder.
    crf : int
        Quality from 1 (best) to 51 (worst).
    """

    def __init__(self, *, width: int, height: int, frame_rate: Fraction, crf: int) -> None:
        self._context = av.CodecContext.create("libx264", "w")
        set_up_encoder(self._context, width=width, height=height)
        self._context.framerate = frame_rate.limit_denominator(100_000)
        self._context.gop_size = _KEYFRAME_DISTANCE
        self._context.max_b_frames = 0
        # zerolatency: no picture waits for another. Without a container to keep them, x264
        # repeats the parameter sets at each keyframe.
        self._context.options = {"crf": str(crf), "preset": "superfast", "tune": "zerolatency"}
        self._last_tick = -1

    def encode(self, image: Image, pts_ns: int) -> bytes:
        """Encode a picture, (height, width) or (height, width, 3) in the order B, G, R.

        Parameters
        ----------
        image : Image
            The picture.
        pts_ns : int
            Its time in nanoseconds, later than the one before.

        Returns
        -------
        bytes
            An access unit in Annex B.
        """
        frame = yuv_frame(image)
        self._last_tick = max(ticks(pts_ns), self._last_tick + 1)
        frame.pts, frame.time_base = self._last_tick, self._context.time_base
        (packet,) = self._context.encode(frame)
        return bytes(packet)
