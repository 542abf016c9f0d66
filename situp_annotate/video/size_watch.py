"""Notice a change of picture size from packets alone.

OpenCV converts every picture as if it had the first one's size, without a word and without a
bound on memory, so a change has to be found before it decodes. Of most codecs that were made for
broadcasting, a stream can change its size only where its parameter sets change; the few packets
that bring new ones are decoded, all others are not.
"""

from contextlib import suppress

import av
from av.bitstream import BitStreamFilterContext
from av.packet import Packet
from av.video.stream import VideoStream

from situp_annotate.video.pyav_stream import decoder_options

__all__ = ["SizeWatch"]

_SIZE_IN_PARAMETER_SETS = frozenset({"h264", "hevc", "mpeg1video", "mpeg2video", "mpeg4"})
# Every keyframe of these states the size; between them it may change in VP9.
_SIZE_IN_KEYFRAMES = frozenset({"vp8", "vp9"})


class SizeWatch:
    """Looks at the packets of a stream for a picture of another size.

    Parameters
    ----------
    stream : VideoStream
        An open stream.
    max_pixels : int
        Larger pictures are not decoded.

    Attributes
    ----------
    misses_nothing : bool
        Whether no change of size can escape it.
    """

    def __init__(self, stream: VideoStream, max_pixels: int) -> None:
        self._context = stream.codec_context
        self._options = decoder_options(max_pixels)
        self._size_hw = self._context.height, self._context.width
        self._looked = False
        self._parameters: bytes | None = None
        codec = self._context.codec.canonical_name
        self._every_keyframe = codec in _SIZE_IN_KEYFRAMES
        self._filter: BitStreamFilterContext | None = None
        if codec in _SIZE_IN_PARAMETER_SETS:
            # mp4 and Matroska put lengths where other containers have start codes.
            has_lengths = (self._context.extradata or b"").startswith(b"\x01")
            to_start_codes = f"{codec}_mp4toannexb," if has_lengths else ""
            with suppress(av.FFmpegError):  # where the stream's own parameter sets are broken
                self._filter = BitStreamFilterContext(f"{to_start_codes}extract_extradata", stream)
        self.misses_nothing = self._filter is not None

    def look(self, packet: "Packet[VideoStream]") -> tuple[int, int] | None:
        """Look at one packet.

        Returns
        -------
        tuple of int or None
            Height and width as stored (not turned), where a packet may bring new ones; (0, 0) if
            they are refused.
        """
        if not self._may_bring_size(packet):
            return None
        unknown = self._size_hw == (0, 0)
        self._looked = True
        self._size_hw = self._stated_size(packet)
        return None if unknown and self._size_hw == (0, 0) else self._size_hw

    def _may_bring_size(self, packet: "Packet[VideoStream]") -> bool:
        if packet.has_sidedata("new_extradata"):
            return True
        if self._filter is None:
            return self._every_keyframe and packet.is_keyframe
        brings = self._brings_parameters(packet, self._filter)
        return brings or (packet.is_keyframe and not self._looked)

    def _brings_parameters(
        self, packet: "Packet[VideoStream]", extract: BitStreamFilterContext
    ) -> bool:
        try:
            filtered = extract.filter(Packet(bytes(packet)))  # a filter keeps what it is given
        except av.FFmpegError:
            return True  # broken: who knows
        previous = self._parameters
        for each in filtered:
            if each.has_sidedata("new_extradata"):
                self._parameters = bytes(each.get_sidedata("new_extradata"))
        return previous != self._parameters

    def _stated_size(self, packet: "Packet[VideoStream]") -> tuple[int, int]:
        context = av.CodecContext.create(self._context.codec.name, "r")
        assert isinstance(context, av.VideoCodecContext)
        context.extradata = self._context.extradata
        context.height, context.width = self._size_hw
        context.thread_count = 1
        context.options = self._options
        try:
            context.decode(packet)
            context.decode(None)
        except av.FFmpegError:
            pass  # what it says of its size is known all the same
        return context.height, context.width
