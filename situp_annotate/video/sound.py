"""The sound of a video, taken along into an mp4 that is made of its pictures."""

from collections.abc import Iterator
from fractions import Fraction
from io import BytesIO
from pathlib import Path
from typing import TypeAlias

import av
from av.audio.stream import AudioStream
from av.container import InputContainer, OutputContainer
from av.packet import Packet

from situp_annotate.types import NS_PER_S
from situp_annotate.video.pyav_stream import open_container, video_stream

__all__ = ["SoundTrack"]

_COPIED = frozenset({"aac", "ac3", "alac", "eac3", "flac", "mp3", "opus"})
"""Codecs that an mp4 may hold."""

_AAC_RATE = 48_000

_Packet: TypeAlias = "Packet[AudioStream]"


class SoundTrack:
    """Puts the sound of a video file beside its pictures, neither earlier nor later than it was.

    The packets are copied as they are, or encoded anew as AAC where an mp4 cannot hold them.
    Damaged ones are left out. Of several sound tracks the one is taken that players choose.

    Parameters
    ----------
    source : Path
        A video file. A folder of pictures, or a file without sound, gives nothing.
    output : OutputContainer
        The file to add the sound to; its header must not be written yet.
    """

    def __init__(self, source: Path, output: OutputContainer) -> None:
        self._output = output
        self._container = None if source.is_dir() else open_container(source.absolute())
        self._packets = _packets(self._container, source, output) if self._container else iter(())
        self._waiting = next(self._packets, None)

    def write_until(self, time_ns: int | None) -> None:
        """Add what is heard up to a time of the pictures; None for all the rest."""
        while self._waiting is not None:
            packet = self._waiting
            if time_ns is not None and _seconds(packet) * NS_PER_S > time_ns:
                return
            self._output.mux(packet)
            self._waiting = next(self._packets, None)

    def close(self) -> None:
        """Free the source."""
        if self._container is not None:
            self._container.close()


def _seconds(packet: _Packet) -> Fraction:
    return (packet.dts or 0) * packet.time_base


def _packets(container: InputContainer, path: Path, output: OutputContainer) -> Iterator[_Packet]:
    """Sound packets for the output, timed from the first picture, in order."""
    stream = container.streams.best("audio")
    if not isinstance(stream, AudioStream) or not stream.codec_context.sample_rate:
        return iter(())
    video = video_stream(container, path)
    start = (video.start_time or 0) * (video.time_base or Fraction(0))
    if _can_be_copied(stream):
        return _copied(container, stream, output.add_stream_from_template(stream), start)
    layout = "mono" if stream.codec_context.layout.nb_channels == 1 else "stereo"
    encoder = output.add_stream("aac", rate=_AAC_RATE, layout=layout)
    return _encoded(container, stream, encoder, start)


def _can_be_copied(stream: AudioStream) -> bool:
    """Whether an mp4 holds such sound; not all of a codec's variants, such as slow MP3."""
    if stream.codec_context.codec.canonical_name not in _COPIED:
        return False
    try:
        with av.open(BytesIO(), "w", format="mp4") as trial:
            trial.add_stream_from_template(stream)
            trial.start_encoding()
    except av.FFmpegError:
        return False
    return True


def _demuxed(container: InputContainer, stream: AudioStream) -> Iterator[_Packet]:
    packets = container.demux(stream)
    while True:
        try:
            yield next(packets)
        except (StopIteration, av.FFmpegError):
            return  # the file ends here, in good order or cut off


def _copied(
    container: InputContainer, stream: AudioStream, copy: AudioStream, start: Fraction
) -> Iterator[_Packet]:
    last = None
    for packet in _demuxed(container, stream):
        # A muxer takes nothing else; players would skip it.
        if packet.dts is None or packet.pts is None or (last is not None and packet.dts <= last):
            continue
        last = packet.dts
        shift = round(start / packet.time_base)
        packet.pts, packet.dts = packet.pts - shift, packet.dts - shift
        packet.stream = copy
        yield packet


def _encoded(
    container: InputContainer, stream: AudioStream, encoder: AudioStream, start: Fraction
) -> Iterator[_Packet]:
    for packet in _demuxed(container, stream):
        try:
            frames = packet.decode()
        except av.FFmpegError:
            continue
        for frame in frames:
            if frame.pts is not None and frame.time_base is not None:
                # By samples: in other units the encoder's own blocks would get the same times.
                heard = (frame.pts * frame.time_base - start) * frame.sample_rate
                frame.pts, frame.time_base = round(heard), Fraction(1, frame.sample_rate)
            yield from encoder.encode(frame)
    yield from encoder.encode(None)
