"""Open a video: find out what stands at a path, and who can decode it."""

import stat
from fractions import Fraction
from pathlib import Path
from typing import Literal

from situp_annotate.errors import VideoEmptyError, VideoMissingError
from situp_annotate.types import VideoInfo
from situp_annotate.video.decoder import Decoder
from situp_annotate.video.image_folder import ImageFolderDecoder
from situp_annotate.video.opencv_decoder import OpenCvDecoder
from situp_annotate.video.probe import Probe, probe_video
from situp_annotate.video.pyav_decoder import PyAvDecoder
from situp_annotate.video.source import FrameSource

__all__ = ["open_video"]

_NOMINAL_RATE = Fraction(25)


def _describe_file(path: Path, probe: Probe, decoder: Decoder) -> VideoInfo:
    height, width = decoder.size_hw
    turned = decoder.rotation_degrees % 180 != 0
    return VideoInfo(
        path=path,
        decoder=decoder.name,
        width=width,
        height=height,
        frame_rate=probe.frame_rate,
        frame_count_from_header=probe.frame_count_from_header,
        rotation_degrees=decoder.rotation_degrees,
        codec=probe.codec,
        pixel_aspect_ratio=1 / probe.pixel_aspect_ratio if turned else probe.pixel_aspect_ratio,
        timestamps="stream" if probe.timestamps_usable else "frame_rate",
    )


def _describe_folder(path: Path, decoder: ImageFolderDecoder) -> VideoInfo:
    height, width = decoder.size_hw
    return VideoInfo(
        path=path,
        decoder=decoder.name,
        width=width,
        height=height,
        frame_rate=_NOMINAL_RATE,
        frame_count_from_header=len(decoder.paths),
        codec="images",
        timestamps="frame_rate",
    )


def _can_be_named(path: Path) -> bool:
    """Whether a path is UTF-8 text: OpenCV crashes at others."""
    try:
        str(path).encode()
    except UnicodeEncodeError:
        return False
    return True


def _start_decoder(path: Path, probe: Probe) -> Decoder:
    """Return the first decoder that gets a picture, standing at that picture."""
    if _can_be_named(path):
        opencv = OpenCvDecoder(path, coded_pictures=probe.coded_pictures, grey=probe.grey)
        if opencv.advance():
            return opencv
        opencv.close()
    pyav = PyAvDecoder(path, grey=probe.grey)
    if pyav.advance():
        return pyav
    pyav.close()
    raise VideoEmptyError(
        f"{path}: the file opens as {probe.codec} video, but neither OpenCV nor PyAV decodes a "
        "single frame of it; convert it, for instance to H.264."
    )


def open_video(path: Path, *, incomplete: Literal["fail", "keep"] = "fail") -> FrameSource:
    """Open a video file or a folder of pictures and decode its first frame.

    OpenCV decodes; where it opens a file and gets nothing out of it, PyAV does. Pictures of a
    folder (or of its ``img``, OTB's layout) are taken in natural order, at a nominal 25 a second.

    Parameters
    ----------
    path : Path
        The file or folder.
    incomplete : {"fail", "keep"}
        What becomes of a video that ends early or changes its size: an error, or a finding and
        the frames up to there.

    Returns
    -------
    FrameSource
        To be used in a ``with`` statement.

    Raises
    ------
    VideoMissingError
        If nothing is there or it cannot be read.
    VideoFormatError
        If it is no video and no folder of pictures.
    VideoEmptyError
        If no frame can be decoded.
    VideoIncompleteError
        If the first picture of a folder cannot be read.
    """
    place = path.absolute()  # FFmpeg would read a relative "concat:a|b" as a protocol
    try:
        mode = place.stat().st_mode
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise VideoMissingError(
            f"{path}: nothing there that can be read ({reason}); correct the path or its "
            "permissions."
        ) from error
    keep = incomplete == "keep"
    if not stat.S_ISDIR(mode):
        probe = probe_video(place)
        decoder = _start_decoder(place, probe)
        info = _describe_file(path, probe, decoder)
        return FrameSource(info, decoder, probe, keep_incomplete=keep)
    images = ImageFolderDecoder(place)
    images.advance()
    return FrameSource(_describe_folder(path, images), images, None, keep_incomplete=keep)
