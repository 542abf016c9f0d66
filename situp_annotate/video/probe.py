"""What a video file says of itself, and what its packets say: demuxed once, nothing decoded."""

import re
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

from av.container import InputContainer
from av.video.stream import VideoStream

from situp_annotate.errors import VideoEmptyError
from situp_annotate.limits import Limits
from situp_annotate.types import NS_PER_S
from situp_annotate.video.bounds import too_large, too_long
from situp_annotate.video.mp4_claims import claimed_pictures
from situp_annotate.video.packet_times import PacketTimes
from situp_annotate.video.pyav_stream import (
    open_container,
    read_packets,
    shows_picture,
    video_stream,
)
from situp_annotate.video.size_watch import SizeWatch

__all__ = ["Probe", "SizeChange", "is_grey", "probe_video", "ticks_to_ns"]

_DEFAULT_RATE = Fraction(25)
_SANE_RATES = (Fraction(1, 60), Fraction(500))  # AVI headers may give the clock's rate, say 600
_MAX_DENOMINATOR = 65_535


@dataclass(frozen=True, slots=True)
class SizeChange:
    """Where pictures change their size midway.

    Attributes
    ----------
    frame : int
        Index of the first picture of the new size, if all pictures before it decode.
    time_ns : int or None
        Its time from the start of the stream.
    size_hw : tuple of int
        New height and width as stored (not turned).
    """

    frame: int
    time_ns: int | None
    size_hw: tuple[int, int]


@dataclass(frozen=True, slots=True)
class Probe:
    """What is known before decoding.

    Attributes
    ----------
    codec, pixel_format : str
        Names such as ``"h264"``, ``"yuv420p"``.
    frame_count_from_header : int or None
        What the container promises; often wrong.
    coded_pictures : int
        Packets that should give a picture each.
    frame_rate : Fraction
        Average pictures a second.
    timestamps_usable : bool
        Whether pictures carry times that put them in order.
    usual_step_ns : int
        Median time from picture to picture.
    regular : bool
        Whether nearly all steps are the usual one.
    last_ns, end_ns : int or None
        Time of the last picture that is in the file, and where that picture ends.
    promised_end_ns : int or None
        Where the pictures should end according to the header; None when it does not say.
    pixel_aspect_ratio : Fraction
        Width of a pixel over its height, as stored (not turned).
    size_change : SizeChange or None
        The first change of size that packets tell of.
    tells_all_sizes : bool
        Whether there can be no changes of size that packets do not tell of.
    alone : bool
        Whether there is no other stream of pictures in the file, such as a cover.
    """

    codec: str
    pixel_format: str
    frame_count_from_header: int | None
    coded_pictures: int
    frame_rate: Fraction
    timestamps_usable: bool
    usual_step_ns: int
    regular: bool
    last_ns: int | None
    end_ns: int | None
    promised_end_ns: int | None
    pixel_aspect_ratio: Fraction
    size_change: SizeChange | None
    tells_all_sizes: bool
    alone: bool

    @property
    def grey(self) -> bool:
        """Whether the stream has no colour."""
        return is_grey(self.pixel_format)


def is_grey(pixel_format: str) -> bool:
    """Whether FFmpeg's pixel format of this name has no colour."""
    return pixel_format.startswith(("gray", "mono", "ya"))


def ticks_to_ns(ticks: int, time_base: Fraction) -> int:
    """Turn ticks of `time_base` seconds into nanoseconds, rounded."""
    return round(ticks * time_base * NS_PER_S)


def probe_video(path: Path, limits: Limits | None = None) -> Probe:
    """Read all packets of a video file once, without decoding them.

    Parameters
    ----------
    path : Path
        An absolute path.
    limits : Limits, optional
        How large and how many pictures may be.

    Raises
    ------
    VideoMissingError
        If there is no such file or it cannot be read.
    VideoFormatError
        If it is no video, or has no video stream.
    VideoEmptyError
        If there is a video stream without a single packet.
    VideoTooLargeError
        If it is beyond a limit.
    """
    limits = limits or Limits()
    if claimed_pictures(path) > limits.max_frames:
        raise too_long(path, limits.max_frames)
    with open_container(path, max_pixels=limits.max_pixels) as container:
        stream = video_stream(container, path)
        _check_header(stream, path, limits)
        survey = _survey(container, stream, path, limits)
        if survey.times.count == 0:
            raise VideoEmptyError(
                f"{path}: the video stream holds no picture at all; record or convert it anew."
            )
        return _conclude(container, stream, survey)


@dataclass(slots=True)
class _Survey:
    """Running figures of one pass over the packets."""

    times: PacketTimes = field(default_factory=PacketTimes)
    first_key_pts: int | None = None
    keyframe_seen: bool = False
    undecodable: int = 0
    first_size_hw: tuple[int, int] | None = None
    size_change: SizeChange | None = None
    tells_all_sizes: bool = False

    def count(self, pts: int | None, dts: int | None, duration: int) -> None:
        """Take in one coded picture."""
        if not self.keyframe_seen:
            self.undecodable += 1  # builds on a keyframe that is not in the file
        elif pts is not None and self.first_key_pts is not None and pts < self.first_key_pts:
            self.undecodable += 1  # stored after the first keyframe, built on the one before it
        self.times.add(pts, dts, duration)

    def note_size(self, size_hw: tuple[int, int], time_ns: int | None) -> None:
        """Take in the size of the picture that is counted next."""
        if self.first_size_hw is None:
            self.first_size_hw = size_hw
        if size_hw != self.first_size_hw and self.size_change is None:
            self.size_change = SizeChange(self.times.count, time_ns, size_hw)


def _check_header(stream: VideoStream, path: Path, limits: Limits) -> None:
    height, width = stream.codec_context.height, stream.codec_context.width
    if height * width > limits.max_pixels:
        raise too_large(path, "the picture", (height, width), limits.max_pixels)
    if stream.frames > limits.max_frames:
        raise too_long(path, limits.max_frames)


def _survey(container: InputContainer, stream: VideoStream, path: Path, limits: Limits) -> _Survey:
    watch = SizeWatch(stream, limits.max_pixels)
    survey = _Survey(tells_all_sizes=watch.misses_nothing)
    for number, packet in enumerate(read_packets(container, stream)):
        if number > limits.max_frames:
            raise too_long(path, limits.max_frames)
        pts, dts, duration = packet.pts, packet.dts, packet.duration or 0
        if packet.is_keyframe and not survey.keyframe_seen:
            survey.keyframe_seen, survey.first_key_pts = True, pts
        size_hw = watch.look(packet) if packet.size else None
        if size_hw is not None:
            if not 0 < size_hw[0] * size_hw[1] <= limits.max_pixels:
                which = f"picture {survey.times.count}"
                raise too_large(path, which, size_hw, limits.max_pixels)
            survey.note_size(size_hw, None if pts is None else _since_start_ns(pts, stream))
        if packet.is_discard or not shows_picture(packet, stream):
            continue  # hidden by an edit list, or never to be seen
        survey.count(pts, dts, duration)
    survey.times.finish()
    return survey


def _since_start_ns(pts: int, stream: VideoStream) -> int:
    return ticks_to_ns(pts - (stream.start_time or 0), stream.time_base or Fraction(1, 1000))


def _conclude(container: InputContainer, stream: VideoStream, survey: _Survey) -> Probe:
    times, context = survey.times, stream.codec_context
    # AVI stores decoding order only; what FFmpeg makes of it fails where pictures are reordered.
    is_avi = container.format.name == "avi"
    usable = times.usable and not (is_avi and context.has_b_frames)
    rate = _frame_rate(stream, times)
    last, end = times.last, times.end
    step = times.usual_step
    time_base = stream.time_base or Fraction(1, 1000)
    return Probe(
        codec=context.codec.canonical_name,
        pixel_format=context.pix_fmt or "unknown",
        frame_count_from_header=stream.frames or None,
        coded_pictures=times.count - survey.undecodable,
        frame_rate=rate,
        timestamps_usable=usable,
        # Damaged headers may claim more pictures a second than it has nanoseconds.
        usual_step_ns=max(
            1, round(NS_PER_S / rate) if step is None else ticks_to_ns(step, time_base)
        ),
        regular=usable and times.regular,
        last_ns=None if last is None else _since_start_ns(last, stream),
        end_ns=None if end is None else _since_start_ns(end, stream),
        # A stream without times has a length only by an estimate from its bit rate.
        promised_end_ns=_promised_end_ns(container, stream) if usable or is_avi else None,
        pixel_aspect_ratio=stream.sample_aspect_ratio or Fraction(1),
        size_change=survey.size_change,
        tells_all_sizes=survey.tells_all_sizes,
        alone=len(container.streams.video) == 1,
    )


def _frame_rate(stream: VideoStream, times: PacketTimes) -> Fraction:
    """Average pictures a second: by the packets' times, else by the header, else 25."""
    from_header = stream.guessed_rate or stream.average_rate
    if from_header is not None and not _SANE_RATES[0] <= from_header <= _SANE_RATES[1]:
        from_header = None
    per_tick = times.pictures_per_tick
    if per_tick is not None and stream.time_base:
        measured = per_tick / stream.time_base
    elif stream.duration and stream.time_base:
        measured = times.count / (stream.duration * stream.time_base)
    else:
        return from_header or _DEFAULT_RATE
    # Times in whole milliseconds make 29.9966 of 30000/1001.
    if from_header is not None and abs(measured / from_header - 1) < Fraction(1, 500):
        return from_header
    # Damaged times may be years apart.
    return measured.limit_denominator(_MAX_DENOMINATOR) or from_header or _DEFAULT_RATE


def _promised_end_ns(container: InputContainer, stream: VideoStream) -> int | None:
    """Where the pictures should end, from the stream's start, by the header."""
    start_ns = ticks_to_ns(stream.start_time or 0, stream.time_base or Fraction(1, 1000))
    whole_ns = None if container.duration is None else container.duration * 1000
    if stream.duration is not None and stream.time_base is not None:
        if container.format.name == "avi" and stream.frames:
            # FFmpeg shortens the duration of an AVI that was cut off. Its header counts ticks.
            return ticks_to_ns(stream.frames, stream.time_base)
        return ticks_to_ns(stream.duration, stream.time_base)
    # Matroska counts from the file's zero, and its container is as long as its longest stream.
    for key, value in stream.metadata.items():
        match = re.fullmatch(r"(\d+):(\d+):(\d+(?:\.\d+)?)", value)
        if key.upper().startswith("DURATION") and match:
            hours, minutes, seconds = match.groups()
            whole = int(hours) * 3600 + int(minutes) * 60 + Fraction(seconds)
            return round(whole * NS_PER_S) - start_ns
    alone = len(container.streams) == 1
    return whole_ns - start_ns if alone and whole_ns is not None else None
