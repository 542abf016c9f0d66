"""The picture channel of an MCAP log: one message a frame, at the frame's own time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import cv2
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo

from situp_annotate.errors import RecipeError, VideoError
from situp_annotate.formats.mcap.file import timestamp
from situp_annotate.types import Frame, VideoInfo
from situp_annotate.video.annexb import ANNEXB_CODECS
from situp_annotate.video.picture_encoder import PictureEncoder
from situp_annotate.video.picture_packets import coded_pictures, why_not_passed_on

__all__ = ["McapOptions", "Pictures", "open_pictures"]

_VIDEO_TOPIC = "/camera/video"
_IMAGE_TOPIC = "/camera/image"
_FRAME_ID = "camera"
_FORMATS = {"h264": "h264", "hevc": "h265"}
"""foxglove.CompressedVideo's names of FFmpeg's codecs."""


@dataclass(frozen=True, slots=True)
class McapOptions:
    """Which pictures go into ``annotations.mcap``, all in the size of the video.

    Attributes
    ----------
    pictures : str
        ``"auto"``: the video's own coded pictures where they are H.264 or H.265 that viewers
        can show as it is, else H.264 encoded anew. ``"h264"``: as before, but H.265 is encoded
        anew too. ``"jpeg"``: a JPEG a frame, for viewers without video. ``"none"``.
    crf : int
        x264's quality, from 1 (best) to 51 (worst), where pictures are encoded anew.
    jpeg_quality : int
        From 1 (worst) to 100 (best).

    Raises
    ------
    RecipeError
        If ``crf`` or ``jpeg_quality`` is out of its range.
    """

    pictures: Literal["auto", "h264", "jpeg", "none"] = "auto"
    crf: int = 23
    jpeg_quality: int = 80

    def __post_init__(self) -> None:
        if not 1 <= self.crf <= 51:
            raise RecipeError(f"crf = {self.crf} is not allowed: give from 1 to 51.")
        if not 1 <= self.jpeg_quality <= 100:
            raise RecipeError(
                f"jpeg_quality = {self.jpeg_quality} is not allowed: give from 1 to 100."
            )


class Pictures(Protocol):
    """Where the messages of the picture channel come from.

    Attributes
    ----------
    topic : str
        Of the channel.
    schema : type
        Class of its messages.
    wants_pictures : bool
        Whether frames must come with their pictures.
    origin : str
        How the pictures came about, for people.
    """

    topic: str
    schema: Any
    wants_pictures: bool
    origin: str

    def message(self, frame: Frame) -> Any:  # noqa: ANN401
        """Make the message of the next frame."""

    def close(self) -> None:
        """Free what is held."""


def _video_message(frame: Frame, data: bytes, codec: str) -> CompressedVideo:
    return CompressedVideo(
        timestamp=timestamp(frame.pts_ns), frame_id=_FRAME_ID, data=data, format=_FORMATS[codec]
    )


class _PassedOn:
    """The video's own coded pictures."""

    topic, schema, wants_pictures = _VIDEO_TOPIC, CompressedVideo, False

    def __init__(self, info: VideoInfo) -> None:
        self.origin = f"{_FORMATS[info.codec]}, as in the source"
        self._info = info
        self._pictures = coded_pictures(info)

    def message(self, frame: Frame) -> CompressedVideo:
        data = next(self._pictures, None)
        if data is None:
            raise VideoError(
                f"{self._info.path}: reading it again gave no picture for frame {frame.index}; do "
                "not change a video while it is annotated."
            )
        return _video_message(frame, data, self._info.codec)

    def close(self) -> None:
        self._pictures.close()


class _EncodedAnew:
    """H.264 made of the frames."""

    topic, schema, wants_pictures = _VIDEO_TOPIC, CompressedVideo, True

    def __init__(self, info: VideoInfo, crf: int, reason: str) -> None:
        self.origin = f"h264, encoded anew: {reason}"
        self._encoder = PictureEncoder(
            width=info.width, height=info.height, frame_rate=info.frame_rate, crf=crf
        )

    def message(self, frame: Frame) -> CompressedVideo:
        return _video_message(frame, self._encoder.encode(frame.image, frame.pts_ns), "h264")

    def close(self) -> None:
        pass


class _Jpegs:
    """A JPEG of each frame."""

    topic, schema, wants_pictures = _IMAGE_TOPIC, CompressedImage, True

    def __init__(self, quality: int) -> None:
        self.origin = f"jpeg, quality {quality}"
        self._settings = [cv2.IMWRITE_JPEG_QUALITY, quality]

    def message(self, frame: Frame) -> CompressedImage:
        _, data = cv2.imencode(".jpg", frame.image, self._settings)
        return CompressedImage(
            timestamp=timestamp(frame.pts_ns),
            frame_id=_FRAME_ID,
            data=data.tobytes(),
            format="jpeg",
        )

    def close(self) -> None:
        pass


def open_pictures(
    info: VideoInfo, times_ns: Sequence[int], options: McapOptions
) -> Pictures | None:
    """Choose where the pictures of a video come from, before anything is written.

    Parameters
    ----------
    info : VideoInfo
        The video.
    times_ns : sequence of int
        Times of all its frames, by index.
    options : McapOptions
        What the recipe wants.

    Returns
    -------
    Pictures or None
        None for a log without pictures.

    Raises
    ------
    VideoError
        If the video cannot be read.
    """
    if options.pictures == "none":
        return None
    if options.pictures == "jpeg":
        return _Jpegs(options.jpeg_quality)
    codecs = ANNEXB_CODECS if options.pictures == "auto" else {"h264"}
    reason = why_not_passed_on(info, times_ns, codecs)
    return _PassedOn(info) if reason is None else _EncodedAnew(info, options.crf, reason)
