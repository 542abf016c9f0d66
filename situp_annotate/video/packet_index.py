"""A video stream by the numbers of its packets, so that decoding can start again in the middle."""

from array import array
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import TypeAlias

import av
from av.packet import Packet
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from situp_annotate.video.probe import is_grey, ticks_to_ns
from situp_annotate.video.pyav_stream import open_stream, read_packets

__all__ = ["IndexedStream"]

_NONE = -(2**63)
# Codecs of whose packets FFmpeg can tell that no picture is built on theirs. HEVC's mark says so
# of some layers only.
_SKIPPING_CODECS = frozenset({"h264", "mpeg2video", "mpeg4"})

_VideoPacket: TypeAlias = "Packet[VideoStream]"


class IndexedStream:
    """A video stream whose pictures say which packet they come from.

    Packets are numbered from 0 in the file's order; one pass over the file lists them, without
    decoding. They are decoded with their number in the place of their time. The decoder hands it
    on as the picture's ``pts``, so that a picture is known exactly, whatever the stream's times
    are like.

    Parameters
    ----------
    path : Path
        An absolute path.
    max_pixels : int
        Larger pictures do not decode.

    Attributes
    ----------
    grey : bool
        Whether the stream has no colour.
    times_ns : list of int or None
        By number: the packet's time from the start of the stream; None without one, and where
        an edit list hides the picture.
    all_timed : bool
        Whether every packet that is to be seen has a time.
    keyframes : list of int
        Numbers of the packets that decoding may start at.
    damaged : bool
        Whether anything that was decoded since the latest start is broken.

    Raises
    ------
    VideoMissingError
        If there is no such file or it cannot be read.
    VideoFormatError
        If it is no video, or has no video stream.
    """

    def __init__(self, path: Path, *, max_pixels: int) -> None:
        self.times_ns: list[int | None] = []
        self.all_timed = True
        self.keyframes: list[int] = []
        self.damaged = False
        self._path = path
        self._max_pixels = max_pixels
        self._positions, self._sizes = array("q"), array("q")
        self._pts, self._dts = array("q"), array("q")
        self._seekable = True
        self._container, self._stream = open_stream(path, max_pixels=max_pixels)
        self.grey = is_grey(self._stream.codec_context.pix_fmt or "")
        for packet in self._packets():
            self._list(packet)

    def _list(self, packet: _VideoPacket) -> None:
        if packet.is_keyframe and not packet.is_discard:
            self.keyframes.append(len(self.times_ns))
        time_ns: int | None = None
        if not packet.is_discard:
            if packet.pts is None or self._stream.time_base is None:
                self.all_timed = False
            else:
                since_start = packet.pts - (self._stream.start_time or 0)
                time_ns = ticks_to_ns(since_start, self._stream.time_base)
        self.times_ns.append(time_ns)
        self._positions.append(_or_none(packet.pos))
        self._sizes.append(packet.size)
        self._pts.append(_or_none(packet.pts))
        self._dts.append(_or_none(packet.dts))

    def time_ns(self, number: int | None) -> int | None:
        """Time of packet `number` from the start of the stream; None when it has none."""
        return None if number is None else self.times_ns[number]

    def close(self) -> None:
        """Free the file."""
        self._container.close()

    def from_start(self) -> Iterator[VideoFrame]:
        """Decode from the first packet, in the very way of reading forward."""
        self._reopen()
        yield from self._decode(enumerate(self._packets()))

    def from_keyframe(
        self, first: int, *, may_skip: Callable[[int], bool] | None = None
    ) -> Iterator[VideoFrame]:
        """Decode from a packet on, to the end.

        Parameters
        ----------
        first : int
            Number of a keyframe. Pictures of packets that follow it may come before its own: in
            an open group of pictures, those that are built on the group before, and are broken.
        may_skip : callable, optional
            Says of a number whether its picture is not wanted. Where no other picture is built
            on such a one, it is not decoded.
        """
        skipping = self._stream.codec_context.codec.canonical_name in _SKIPPING_CODECS
        yield from self._decode(self._numbered_from(first), may_skip if skipping else None)

    def drain(self) -> None:
        """Drop the pictures that are decoded and wait for their turn, and see if they are broken.

        Those that came out already may be built on them.
        """
        self._pictures(None)

    def _decode(
        self,
        packets: Iterator[tuple[int, _VideoPacket]],
        may_skip: Callable[[int], bool] | None = None,
    ) -> Iterator[VideoFrame]:
        self.damaged = False
        for number, packet in packets:
            skip = may_skip is not None and may_skip(number)
            self._stream.codec_context.skip_frame = "NONREF" if skip else "DEFAULT"
            packet.pts, packet.dts = number, None
            yield from self._pictures(packet)
        yield from self._pictures(None)

    def _pictures(self, packet: "_VideoPacket | None") -> list[VideoFrame]:
        try:
            frames = self._stream.codec_context.decode(packet)
        except av.EOFError:
            return []  # drained before
        except av.FFmpegError:
            self.damaged = True
            return []
        self.damaged = self.damaged or any(frame.is_corrupt for frame in frames)
        return frames

    def _packets(self) -> Iterator[_VideoPacket]:
        # An empty packet would make the decoder end.
        return (packet for packet in read_packets(self._container, self._stream) if packet.size)

    def _reopen(self) -> None:
        self._container.close()
        self._container, self._stream = open_stream(self._path, max_pixels=self._max_pixels)

    def _numbered_from(self, first: int) -> Iterator[tuple[int, _VideoPacket]]:
        """Packets from one on: sought if that leads there, else demuxed from the start."""
        for ticks in dict.fromkeys((self._pts[first], self._dts[first])):
            packets = self._sought(first, ticks)
            head = next(packets, None)
            if head is not None:
                yield head
                yield from packets
                return
        self._reopen()
        yield from islice(enumerate(self._packets()), first, None)

    def _sought(self, first: int, ticks: int) -> Iterator[tuple[int, _VideoPacket]]:
        """Packets from one on, after a seek; none where the seek does not lead there."""
        if ticks == _NONE or not self._seekable:
            return
        try:
            self._container.seek(ticks, stream=self._stream, backward=True)
        except av.FFmpegError:
            return
        packets = self._packets()
        for packet in packets:
            if self._is_number(first, packet):
                yield first, packet
                break
            if packet.pos is not None and packet.pos > self._positions[first]:
                return  # MPEG-TS is sought by decoding times: too far
        for number, packet in enumerate(packets, first + 1):
            if not self._is_number(number, packet):
                self._seekable = False  # seeking shows other packets than reading does
                return
            yield number, packet

    def _is_number(self, number: int, packet: _VideoPacket) -> bool:
        if number >= len(self.times_ns):
            return False
        entry = (self._positions[number], self._sizes[number], self._pts[number])
        return entry == (_or_none(packet.pos), packet.size, _or_none(packet.pts))


def _or_none(value: int | None) -> int:
    return _NONE if value is None else value
