"""What a video file's headers, packets and first picture say, beyond what a probe keeps."""

import struct
from array import array
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from av.audio.stream import AudioStream
from av.container import InputContainer
from av.packet import Packet
from av.sidedata.sidedata import Type
from av.stream import Disposition
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from situp_annotate.video.probe import ticks_to_ns
from situp_annotate.video.pyav_stream import (
    decode_packet,
    open_stream,
    read_packets,
    shows_picture,
)

__all__ = ["Picture", "StreamSurvey", "survey_stream"]

_MAX_TIMES = 4_000_000
"""Of so many pictures the times are kept: 37 hours at 30 pictures a second, 32 MB."""

_CODEC_TITLES = {
    "av1": "AV1",
    "ffv1": "FFV1",
    "h264": "H.264",
    "hevc": "H.265",
    "mjpeg": "Motion JPEG",
    "mpeg2video": "MPEG-2",
    "mpeg4": "MPEG-4 Part 2",
    "prores": "ProRes",
    "rawvideo": "uncompressed",
    "vp8": "VP8",
    "vp9": "VP9",
}
_MAX_WAIT = 64
"""Packets after which a first picture is not waited for any longer."""


@dataclass(frozen=True, slots=True)
class Picture:
    """What the first picture says of all.

    Attributes
    ----------
    interlaced : bool
        Whether it is made of two fields, taken one after the other.
    transfer : int
        How light is coded, by the numbers of ITU-T H.273: 16 and 18 are HDR.
    bits : int
        Of a channel.
    alpha : bool
        Whether it has an opacity.
    matrix : tuple of int or None
        The nine numbers of FFmpeg's display matrix; None when it is shown as stored.
    """

    interlaced: bool
    transfer: int
    bits: int
    alpha: bool
    matrix: tuple[int, ...] | None

    @property
    def mirrored(self) -> bool:
        """Whether it is to be shown as in a mirror."""
        if self.matrix is None:
            return False
        a, b, _, c, d = self.matrix[:5]
        return a * d - b * c < 0


@dataclass(frozen=True, slots=True)
class StreamSurvey:
    """What one pass over the packets has shown.

    Attributes
    ----------
    container, container_title : str
        FFmpeg's short names, such as ``"mov,mp4,m4a,3gp,3g2,mj2"``, and its name for people.
    codec_title : str
        Its name for people, with the profile.
    time_base : Fraction
        Seconds a tick.
    header_rate : Fraction or None
        Pictures a second by the header.
    start_ns : int
        Time at which the stream starts by the container's own clock.
    others : tuple of str
        Sizes of the other streams of moving pictures, where they are known.
    audio : tuple of str
        Codecs of the sound tracks, where they are known.
    hidden : int
        Coded pictures that an edit list hides.
    before_keyframe : int
        Coded pictures before the first one that can be decoded without others.
    reordered : bool
        Whether pictures are stored in another order than shown: B-frames.
    longest_group : int
        Most pictures from a keyframe to the next.
    keyframes : int
        Pictures that decoding may start at.
    times_ns : array of int64, shape (n,)
        Sorted times of the pictures that are to be seen, from the start of the stream; of the
        first 4 000 000 at most.
    picture : Picture or None
        The first one that decodes; None without one.
    """

    container: str
    container_title: str
    codec_title: str
    time_base: Fraction
    header_rate: Fraction | None
    start_ns: int
    others: tuple[str, ...]
    audio: tuple[str, ...]
    hidden: int
    before_keyframe: int
    reordered: bool
    longest_group: int
    keyframes: int
    times_ns: npt.NDArray[np.int64]
    picture: Picture | None


@dataclass(slots=True)
class _Walk:
    """Running figures over the packets."""

    times: "array[int]" = field(default_factory=lambda: array("q"))
    hidden: int = 0
    before_keyframe: int = 0
    reordered: bool = False
    longest_group: int = 0
    keyframes: int = 0
    _group: int = 0
    _last_pts: int | None = None

    def add(self, packet: "Packet[VideoStream]") -> None:
        """Take in a packet that holds a picture."""
        self._count_group(packet.is_keyframe)
        if packet.is_discard:
            self.hidden += 1
            return
        if packet.pts is None:
            return
        if self._last_pts is not None and packet.pts < self._last_pts:
            self.reordered = True
        self._last_pts = packet.pts
        if len(self.times) < _MAX_TIMES:
            self.times.append(packet.pts)

    def _count_group(self, is_keyframe: bool) -> None:
        if is_keyframe:
            self.keyframes += 1
            self._group = 0
        elif self.keyframes == 0:
            self.before_keyframe += 1
        self._group += 1
        self.longest_group = max(self.longest_group, self._group)


def survey_stream(path: Path) -> StreamSurvey:
    """Read all packets of a video file once, and decode its first picture.

    Parameters
    ----------
    path : Path
        An absolute path.

    Raises
    ------
    VideoMissingError
        If there is no such file or it cannot be read.
    VideoFormatError
        If it is no video, or has no video stream.
    """
    picture = _first_picture(path)
    container, stream = open_stream(path)
    with container:
        walk = _Walk()
        for packet in read_packets(container, stream):
            if shows_picture(packet, stream):
                walk.add(packet)
        return _conclude(container, stream, walk, picture)


def _conclude(
    container: InputContainer, stream: VideoStream, walk: _Walk, picture: Picture | None
) -> StreamSurvey:
    time_base = stream.time_base or Fraction(1, 1000)
    start = stream.start_time or 0
    context = stream.codec_context
    name = context.codec.canonical_name
    title = _CODEC_TITLES.get(name, name)
    return StreamSurvey(
        container=container.format.name,
        container_title=container.format.long_name,
        codec_title=f"{title} ({context.profile})" if context.profile else title,
        time_base=time_base,
        header_rate=stream.guessed_rate or stream.average_rate,
        start_ns=ticks_to_ns(start, time_base),
        others=tuple(
            _size(other)
            for other in container.streams.video
            if other.index != stream.index and not other.disposition & Disposition.attached_pic
        ),
        audio=tuple(_codec_name(sound) for sound in container.streams.audio),
        hidden=walk.hidden,
        before_keyframe=walk.before_keyframe,
        reordered=walk.reordered,
        longest_group=walk.longest_group,
        keyframes=walk.keyframes,
        times_ns=_to_ns(walk.times, start, time_base),
        picture=picture,
    )


def _size(stream: VideoStream) -> str:
    context: Any = stream.codec_context  # None where FFmpeg does not know the codec
    return "unknown size" if context is None else f"{context.width} × {context.height}"


def _codec_name(stream: AudioStream) -> str:
    context: Any = stream.codec_context  # likewise
    return "of an unknown codec" if context is None else str(context.name)


def _to_ns(times: "array[int]", start: int, time_base: Fraction) -> npt.NDArray[np.int64]:
    # In floating point first: ticks × 10⁹ can leave 64 bits; half a nanosecond is nothing here.
    seconds = (np.sort(np.asarray(times, dtype=np.int64)) - start) * float(time_base)
    limit = float(2**61)
    clipped: npt.NDArray[np.float64] = np.clip(np.rint(seconds * 1e9), -limit, limit)
    return clipped.astype(np.int64)


def _first_picture(path: Path) -> Picture | None:
    container, stream = open_stream(path)
    with container:
        for number, packet in enumerate(read_packets(container, stream)):
            frames = decode_packet(packet)
            if frames:
                return _describe(frames[0])
            if number > _MAX_WAIT:
                break
    return None


def _describe(frame: VideoFrame) -> Picture:
    components = frame.format.components
    side_data: Any = frame.side_data  # PyAV's stub knows only its older form
    try:
        matrix = struct.unpack_from("=9i", bytes(side_data[Type.DISPLAYMATRIX]))
    except KeyError:
        matrix = None
    return Picture(
        interlaced=frame.interlaced_frame,
        transfer=int(frame.color_trc),
        bits=max((component.bits for component in components), default=8),
        alpha=any(component.is_alpha for component in components),
        matrix=matrix,
    )
