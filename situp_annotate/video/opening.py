"""Open a video: find out what stands at a path, and who can decode it."""

import stat
from collections.abc import Iterator
from contextlib import ExitStack
from fractions import Fraction
from pathlib import Path
from typing import Literal

import numpy as np

from situp_annotate.errors import VideoEmptyError, VideoIncompleteError, VideoMissingError
from situp_annotate.limits import Limits
from situp_annotate.types import Finding, VideoInfo
from situp_annotate.video.bounds import too_long
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
    """Whether a path is UTF-8 text: no file of labels can hold others, and OpenCV crashes."""
    try:
        str(path).encode()
    except UnicodeEncodeError:
        return False
    return True


def _start_pyav(path: Path, probe: Probe, limits: Limits) -> PyAvDecoder:
    """Return PyAV's decoder, standing at the first picture."""
    decoder = PyAvDecoder(path, grey=probe.grey, max_pixels=limits.max_pixels)
    with ExitStack() as stack:
        stack.callback(decoder.close)
        if not decoder.advance():
            raise VideoEmptyError(
                f"{path}: the file opens as {probe.codec} video, but not a single frame of it "
                "decodes; convert it, for instance to H.264."
            )
        stack.pop_all()
        return decoder


def _start_opencv(path: Path, probe: Probe) -> OpenCvDecoder | None:
    """Return OpenCV's decoder, standing at the first picture; None if it gets none."""
    decoder = OpenCvDecoder(path, coded_pictures=probe.coded_pictures, grey=probe.grey)
    if decoder.advance():
        return decoder
    decoder.close()
    return None


def _see_the_same(one: Decoder, other: Decoder) -> bool:
    """Whether two decoders stand at the same picture."""
    try:
        return one.size_hw == other.size_hw and np.array_equal(one.image(), other.image())
    except VideoIncompleteError:
        return False


def _start_decoder(path: Path, probe: Probe, limits: Limits) -> tuple[Decoder, bool]:
    """Choose a decoder, standing at the first picture, and say whether OpenCV has failed.

    OpenCV knows no bound, and decodes some of each stream in opening: it gets a file in which all
    pictures are known to be small enough. Where it does not know the colours of a picture, it
    returns what was in its memory.
    """
    pyav = _start_pyav(path, probe, limits)
    if not (probe.alone and _can_be_named(path)):
        return pyav, False
    opencv = _start_opencv(path, probe)
    if opencv is None:
        return pyav, True
    rejected: Decoder = opencv
    chosen: Decoder = pyav
    if probe.tells_all_sizes and _see_the_same(opencv, pyav):
        chosen, rejected = opencv, pyav
    rejected.close()
    return chosen, False


def _findings(probe: Probe, *, opencv_failed: bool) -> Iterator[Finding]:
    if opencv_failed:
        yield Finding(
            "decoder",
            f"OpenCV cannot decode this {probe.codec} video; PyAV decodes it instead.",
        )
    if not probe.timestamps_usable:
        yield Finding(
            "timestamps",
            "The stream has no times that can be used; frames are timed by their number at "
            f"{float(probe.frame_rate):.6g} frames a second.",
        )


def open_video(
    path: Path,
    *,
    incomplete: Literal["fail", "keep"] = "fail",
    limits: Limits | None = None,
) -> FrameSource:
    """Open a video file or a folder of pictures and decode its first frame.

    OpenCV decodes; PyAV does what OpenCV cannot, and videos that may change the size of their
    pictures at any time. Pictures of a folder (or of its ``img``, OTB's layout) are taken in
    natural order, at a nominal 25 a second. Nothing but the file itself is opened, whatever it
    or its name says.

    Parameters
    ----------
    path : Path
        The file or folder.
    incomplete : {"fail", "keep"}
        What becomes of a video that ends early or changes its size: an error, or a finding and
        the frames up to there.
    limits : Limits, optional
        How large and how many pictures may be.

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
    VideoTooLargeError
        If it is beyond a limit.
    """
    limits = limits or Limits()
    if not _can_be_named(path):
        raise VideoMissingError(
            f"{str(path)!a}: the name is not valid UTF-8, and cannot be written down; rename it."
        )
    place = path.absolute()  # FFmpeg would read a relative "concat:a|b" as a protocol
    try:
        mode = place.stat().st_mode
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise VideoMissingError(
            f"{path}: nothing there that can be read ({reason}); correct the path or its "
            "permissions."
        ) from error
    opened = _open_folder if stat.S_ISDIR(mode) else _open_file
    return opened(path, place, limits, keep=incomplete == "keep")


def _open_file(path: Path, place: Path, limits: Limits, *, keep: bool) -> FrameSource:
    probe = probe_video(place, limits)
    decoder, opencv_failed = _start_decoder(place, probe, limits)
    return FrameSource(
        _describe_file(path, probe, decoder),
        decoder,
        probe,
        findings=_findings(probe, opencv_failed=opencv_failed),
        keep_incomplete=keep,
        limits=limits,
    )


def _open_folder(path: Path, place: Path, limits: Limits, *, keep: bool) -> FrameSource:
    images = ImageFolderDecoder(place, max_pixels=limits.max_pixels)
    if len(images.paths) > limits.max_frames:
        raise too_long(path, limits.max_frames)
    images.advance()
    info = _describe_folder(path, images)
    return FrameSource(info, images, None, keep_incomplete=keep, limits=limits)
