"""What everything that decodes with PyAV shares: opening, stepping past damage, pictures."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

import av
import cv2
import numpy as np
import numpy.typing as npt
from av.audio.stream import AudioStream
from av.container import InputContainer
from av.packet import Packet
from av.stream import Disposition
from av.video.codeccontext import VideoCodecContext
from av.video.frame import VideoFrame
from av.video.reformatter import Colorspace, Interpolation
from av.video.stream import VideoStream

from situp_annotate.errors import VideoFormatError, VideoMissingError
from situp_annotate.limits import Limits
from situp_annotate.types import Image
from situp_annotate.video.formats import FILE_ONLY

__all__ = [
    "decode_packet",
    "decoder_options",
    "open_container",
    "open_stream",
    "read_packets",
    "refuses_size",
    "shows_picture",
    "upright_image",
    "video_stream",
]

_Stream = TypeVar("_Stream", AudioStream, VideoStream)

_ALWAYS_ALLOWED_PIXELS = 2**20

_TURNS = {
    90: cv2.ROTATE_90_CLOCKWISE,
    180: cv2.ROTATE_180,
    270: cv2.ROTATE_90_COUNTERCLOCKWISE,
}


def decoder_options(max_pixels: int) -> dict[str, str]:
    """Options by which FFmpeg refuses a picture before there is memory for it.

    FFmpeg counts some columns and rows at the borders, too: it is given some slack, and whoever
    sees the picture's size goes by that.
    """
    return {"max_pixels": str(max(max_pixels * 5 // 4, _ALWAYS_ALLOWED_PIXELS))}


def refuses_size(context: VideoCodecContext, max_pixels: int) -> bool:
    """Whether a decoder with `decoder_options` was last asked for a picture that is too large.

    It then holds that size or, of most codecs, none at all.
    """
    return not 0 < context.width * context.height <= max_pixels


def open_container(path: Path, *, max_pixels: int = Limits().max_pixels) -> InputContainer:
    """Open a video file for demuxing.

    FFmpeg decodes a few pictures already here; none beyond `max_pixels`.

    Raises
    ------
    VideoMissingError
        If there is no such file or it cannot be read.
    VideoFormatError
        If it is no video.
    """
    _check_is_file(path)
    options = FILE_ONLY | decoder_options(max_pixels)
    try:
        # Titles may be in any encoding.
        return av.open(str(path), options=options, metadata_errors="replace")
    except av.ArgumentError as error:
        raise VideoFormatError(
            f"{path}: not a video but a text, a list of files, a single picture, sound alone, or "
            "in a format that is not read here; name a video file or a folder of pictures."
        ) from error
    except (av.FFmpegError, OSError) as error:
        raise VideoFormatError(
            f"{path}: not a video that FFmpeg can read ({error.strerror}); it may be another kind "
            "of file, or a recording that was cut off before its index was written. Replace it or "
            "convert it anew."
        ) from error


def _check_is_file(path: Path) -> None:
    try:
        if path.exists() and not path.is_file():  # a pipe makes whoever opens it wait
            raise VideoFormatError(
                f"{path}: neither a file nor a folder but a pipe, a socket or a device; name a "
                "video file or a folder of pictures."
            )
        path.open("rb").close()
    except OSError as error:
        raise VideoMissingError(
            f"{path}: the video cannot be read ({error.strerror}); correct the path or its "
            "permissions."
        ) from error


def video_stream(container: InputContainer, path: Path) -> VideoStream:
    """Return the stream of moving pictures, the one that OpenCV chooses too.

    Raises
    ------
    VideoFormatError
        If there is none; a cover picture does not count.
    """
    stream = container.streams.best("video")
    if not isinstance(stream, VideoStream) or stream.disposition & Disposition.attached_pic:
        raise VideoFormatError(
            f"{path}: the file holds no video stream, only "
            f"{', '.join(sorted({stream.type for stream in container.streams})) or 'nothing'}; "
            "name a file with moving pictures."
        )
    if stream.codec_context is None:
        raise VideoFormatError(
            f"{path}: FFmpeg does not know how the pictures in this file are coded; convert it."
        )
    return stream


def read_packets(container: InputContainer, stream: _Stream) -> Iterator["Packet[_Stream]"]:
    """Demux one stream from where the file stands, to its end or to where it was cut off.

    The last packet is empty: given to a decoder, it brings out the pictures still in there.
    """
    packets: Iterator[Packet[_Stream]] | None = None
    while True:
        try:
            packets = packets or container.demux(stream)
            yield next(packets)
        except (StopIteration, av.FFmpegError, IndexError):
            # The file ends here, in good order or cut off; with an IndexError where streams have
            # appeared midway.
            return


def shows_picture(packet: "Packet[VideoStream]", stream: VideoStream) -> bool:
    """Whether a packet of a stream holds a picture that is meant to be seen.

    The last packet is empty, as one for a dropped picture is; and VP8 has pictures that are only
    there for others to be built on.
    """
    if packet.size == 0:
        return False
    is_vp8 = stream.codec_context.codec.canonical_name == "vp8"
    return not is_vp8 or bool(memoryview(packet)[0] & 0x10)


def open_stream(
    path: Path, *, max_pixels: int = Limits().max_pixels
) -> tuple[InputContainer, VideoStream]:
    """Open a video file to decode its pictures with one thread.

    Parameters
    ----------
    path : Path
        An absolute path: FFmpeg reads ``name:rest`` as a protocol otherwise.
    max_pixels : int
        Larger pictures do not decode.

    Raises
    ------
    VideoMissingError
        If there is no such file or it cannot be read.
    VideoFormatError
        If it is no video, or has no video stream.
    """
    container = open_container(path, max_pixels=max_pixels)
    try:
        stream = video_stream(container, path)
    except BaseException:
        container.close()
        raise
    stream.thread_type = "NONE"
    stream.codec_context.thread_count = 1
    stream.codec_context.options = decoder_options(max_pixels)
    return container, stream


def decode_packet(packet: "Packet[VideoStream]") -> list[VideoFrame]:
    """Give a packet to its decoder and take what comes out: nothing where it is broken."""
    try:
        return packet.decode()
    except av.FFmpegError:
        return []  # whoever counts the pictures finds out what is missing


def _to_bgr(frame: VideoFrame, colorspace: Colorspace | None = None) -> npt.NDArray[Any]:
    bicubic = Interpolation.BICUBIC
    return frame.to_ndarray(
        format="bgr24", interpolation=bicubic, threads=1, src_colorspace=colorspace
    )


def upright_image(frame: VideoFrame, *, grey: bool, rotation_degrees: int) -> Image:
    """Convert a decoded picture.

    Parameters
    ----------
    frame : VideoFrame
        As it comes from the decoder, in any pixel format.
    grey : bool
        Whether the stream is grey.
    rotation_degrees : int
        Clockwise turn that makes it upright: 0, 90, 180 or 270.

    Returns
    -------
    Image
        (h, w) from a grey stream, else (h, w, 3) as B, G, R; contiguous.

    Raises
    ------
    av.FFmpegError
        If FFmpeg has no way to do it.

    Notes
    -----
    These are OpenCV's pixels, byte for byte: ``cv2.VideoCapture`` too converts with FFmpeg's
    bicubic scaler and no further flags, and takes grey to three equal channels first. PyAV's own
    default is the bilinear one, which differs on 10 bit colour and on odd sizes; accurate
    rounding differs on nearly every picture. Colours that the scaler does not know, such as YCgCo,
    are taken for ITU-R BT.601's.
    """
    try:
        image = _to_bgr(frame)
    except av.FFmpegError:
        image = _to_bgr(frame, Colorspace.ITU601)
    pixels = image[:, :, 0] if grey else image
    turn = _TURNS.get(rotation_degrees)
    upright = pixels if turn is None else cv2.rotate(pixels, turn)
    return np.ascontiguousarray(upright, dtype=np.uint8)
