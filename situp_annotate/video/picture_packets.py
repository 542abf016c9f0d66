"""The coded pictures of a video as they are, for viewers that decode them by themselves.

That spares encoding them anew, where each coded picture stands for one frame: viewers decode
every picture they are given, in the file's order, and show it as it is.
"""

from collections.abc import Generator, Sequence, Set
from dataclasses import dataclass
from fractions import Fraction

import av
from av.bitstream import BitStreamFilterContext
from av.container import InputContainer
from av.video.stream import VideoStream

from situp_annotate.errors import VideoError
from situp_annotate.types import VideoInfo
from situp_annotate.video.annexb import ANNEXB_CODECS, read_head
from situp_annotate.video.probe import ticks_to_ns
from situp_annotate.video.pyav_stream import open_stream, read_packets

__all__ = ["coded_pictures", "why_not_passed_on"]

_PIXEL_FORMATS = frozenset({"yuv420p", "yuvj420p"})
"""What every viewer can decode: 8 bits, colour at half the resolution."""

_TOLERANCE_NS = 1000
"""OpenCV's times are floating-point milliseconds."""


@dataclass(frozen=True, slots=True)
class _Packet:
    """A coded picture as a byte stream, and its time in ticks from the start of the stream."""

    data: bytes
    ticks: int | None
    time_base: Fraction | None
    sound: bool

    @property
    def time_ns(self) -> int | None:
        """Its time from the start of the stream; None if it has none."""
        if self.ticks is None or self.time_base is None:
            return None
        return ticks_to_ns(self.ticks, self.time_base)


def why_not_passed_on(
    info: VideoInfo, times_ns: Sequence[int], codecs: Set[str] = ANNEXB_CODECS
) -> str | None:
    """Say why a video's coded pictures cannot stand for its frames as they are.

    Parameters
    ----------
    info : VideoInfo
        The video.
    times_ns : sequence of int
        Times of all frames that it decodes to, by index.
    codecs : set of str
        Codecs that are allowed, by FFmpeg's names.

    Returns
    -------
    str or None
        A clause such as "the video is rotated"; None when each coded picture gives one frame.

    Raises
    ------
    VideoError
        If the video cannot be read.
    """
    if info.codec not in codecs:
        return f"the source is {info.codec}"
    if info.rotation_degrees:
        return "the source is rotated"
    container, stream = _open(info)
    with container:
        obstacle = _obstacle(stream)
    if obstacle is None and info.timestamps != "stream":
        obstacle = "the source has no usable times"
    return obstacle or _mismatch(info, times_ns)


def _obstacle(stream: VideoStream) -> str | None:
    """What the stream says of itself that forbids it."""
    context = stream.codec_context
    if context.has_b_frames:
        return "the source has B-frames, or says that it may have"
    if any(ratio not in (None, 0, 1) for ratio in _pixel_aspect_ratios(stream)):
        return "the source's pixels are not square, for which viewers would stretch the picture"
    if context.pix_fmt not in _PIXEL_FORMATS:
        return f"the source's pixel format {context.pix_fmt} is not for every viewer"
    return None


def _pixel_aspect_ratios(stream: VideoStream) -> tuple[object, object]:
    """What the container says, and what the coded pictures say."""
    return stream.sample_aspect_ratio, stream.codec_context.sample_aspect_ratio


def _mismatch(info: VideoInfo, times_ns: Sequence[int]) -> str | None:
    """Compare each coded picture with the frame of the same index."""
    count, origin_ns = 0, 0
    try:
        for packet in _packets(info):
            if count == 0:
                origin_ns = min(0, packet.time_ns or 0)  # as Timeline does it
            if count == len(times_ns) or not _stands_for(packet, origin_ns, times_ns[count]):
                return f"coded picture {count} of the source does not give frame {count}"
            head = read_head(packet.data, info.codec)
            if head is None or (count == 0 and not head.keyframe):
                return f"coded picture {count} of the source cannot be decoded by itself"
            if head.keyframe and not head.parameter_sets:
                return f"keyframe {count} of the source lacks its parameter sets"
            count += 1
    except av.FFmpegError:
        return f"coded picture {count} of the source is damaged"
    if count < len(times_ns):
        return f"the source has {count} coded pictures for {len(times_ns)} frames"
    return None


def _stands_for(packet: _Packet, origin_ns: int, frame_ns: int) -> bool:
    time_ns = packet.time_ns
    if not packet.sound or time_ns is None:
        return False
    return abs(time_ns - origin_ns - frame_ns) <= _TOLERANCE_NS


def _open(info: VideoInfo) -> tuple[InputContainer, VideoStream]:
    return open_stream(info.path.absolute(), max_pixels=info.width * info.height)


def _packets(info: VideoInfo) -> Generator[_Packet]:
    container, stream = _open(info)
    with container:
        codec = stream.codec_context.codec.canonical_name
        # Gives keyframes the parameter sets that mp4 and Matroska keep apart.
        to_byte_stream = BitStreamFilterContext(f"{codec}_mp4toannexb", in_stream=stream)
        start, time_base = stream.start_time or 0, stream.time_base
        for packet in read_packets(container, stream):
            if packet.size == 0:
                continue
            ticks = None if packet.pts is None else packet.pts - start
            sound = not (packet.is_discard or packet.is_corrupt)
            data = b"".join(map(bytes, to_byte_stream.filter(packet)))
            yield _Packet(data, ticks, time_base, sound)


def coded_pictures(info: VideoInfo) -> Generator[bytes]:
    """Read the coded pictures of a video for which `why_not_passed_on` has nothing to say.

    Yields
    ------
    bytes
        The picture of the next frame: an access unit in H.264's or H.265's Annex B, which has
        all parameter sets before a keyframe.

    Raises
    ------
    VideoError
        If the video cannot be read any more.
    """
    try:
        for packet in _packets(info):
            yield packet.data
    except av.FFmpegError as error:
        raise VideoError(
            f"{info.path}: reading its coded pictures again failed ({error.strerror}); do not "
            "change a video while it is annotated."
        ) from error
