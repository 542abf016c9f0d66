"""Notice a change of picture size from packets alone.

OpenCV rescales every picture to the first one's size without a word, so a change has to be
found before it decodes. A stream can change its size only where its parameter sets change; the
few packets that bring new ones are decoded, all others are not.
"""

import av
from av.bitstream import BitStreamFilterContext
from av.packet import Packet
from av.video.stream import VideoStream

__all__ = ["SizeWatch"]

# Codecs without parameter sets: every keyframe states the size.
_SIZE_IN_KEYFRAMES = frozenset({"vp8", "vp9"})


class SizeWatch:
    """Looks at the packets of a stream for a picture of another size.

    Parameters
    ----------
    stream : VideoStream
        An open stream.
    """

    def __init__(self, stream: VideoStream) -> None:
        self._context = stream.codec_context
        self._first_size_hw: tuple[int, int] | None = None
        self._every_keyframe = self._context.codec.canonical_name in _SIZE_IN_KEYFRAMES
        self._parameters: bytes | None = None
        self._filter: BitStreamFilterContext | None = None
        # avcC and hvcC records start with 1: such streams hold no start codes to find
        # parameter sets by, and announce new ones as side data of a packet.
        if not (self._context.extradata or b"").startswith(b"\x01"):
            try:
                self._filter = BitStreamFilterContext("extract_extradata", in_stream=stream)
            except (av.FFmpegError, ValueError):
                self._filter = None  # a codec without parameter sets

    def look(self, packet: "Packet[VideoStream]") -> tuple[int, int] | None:
        """Look at one packet, which is empty afterwards.

        Returns
        -------
        tuple of int or None
            Height and width as stored (not turned), when they differ from the stream's first.
        """
        suspicious = self._every_keyframe and packet.is_keyframe
        if packet.has_sidedata("new_extradata"):
            suspicious = True
        elif self._filter is not None and packet.is_keyframe:
            filtered = self._filter.filter(packet)
            if not filtered:
                return None
            packet = filtered[0]
            suspicious = self._brings_new_parameters(packet)
        first = self._first_size_hw is None and packet.is_keyframe
        if not (suspicious or first):
            return None
        size_hw = self._decoded_size(packet)
        if self._first_size_hw is None:
            self._first_size_hw = size_hw
        return size_hw if size_hw != self._first_size_hw else None

    def _brings_new_parameters(self, packet: "Packet[VideoStream]") -> bool:
        if not packet.has_sidedata("new_extradata"):
            return False
        previous, self._parameters = self._parameters, bytes(packet.get_sidedata("new_extradata"))
        return previous != self._parameters

    def _decoded_size(self, packet: "Packet[VideoStream]") -> tuple[int, int] | None:
        context = av.CodecContext.create(self._context.codec.name, "r")
        assert isinstance(context, av.VideoCodecContext)
        context.extradata = self._context.extradata
        context.thread_count = 1
        try:
            frames = context.decode(packet) + context.decode(None)
        except av.FFmpegError:
            return self._first_size_hw
        return (frames[-1].height, frames[-1].width) if frames else self._first_size_hw
