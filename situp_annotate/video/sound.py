"""The sound of a video, taken along into an mp4 that is made of its pictures."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from fractions import Fraction
from itertools import chain, groupby
from pathlib import Path
from typing import TypeAlias

import av
from av.audio.frame import AudioFrame
from av.audio.resampler import AudioResampler
from av.audio.stream import AudioStream
from av.container import InputContainer, OutputContainer
from av.packet import Packet

from situp_annotate.errors import VideoError
from situp_annotate.types import NS_PER_S
from situp_annotate.video.pyav_stream import open_container, read_packets, video_stream
from situp_annotate.video.rehearsal import Rehearsal

__all__ = ["SoundTrack"]

_COPIED = frozenset({"aac", "ac3", "alac", "eac3", "flac", "mp3", "opus"})
"""Codecs that an mp4 may hold."""

_AAC_RATE = 48_000

_DAMAGE = (av.FFmpegError, VideoError, ArithmeticError, LookupError, TypeError, ValueError)
"""What FFmpeg's binding, and reckoning with what it says, raise at damaged sound."""

_Packet: TypeAlias = "Packet[AudioStream]"


class SoundTrack:
    """Puts the sound of a video file beside its pictures, neither earlier nor later than it was.

    The packets are copied as they are, or encoded anew as AAC where an mp4 cannot hold them.
    Damaged ones are left out, and where nothing more can be read the sound ends: it is never a
    reason to do without the pictures. Of several sound tracks the one is taken that players
    choose.

    Parameters
    ----------
    source : Path
        A video file. A folder of pictures, or a file without sound, gives nothing.
    output : OutputContainer
        The file to add the sound to; its header must not be written yet.
    """

    def __init__(self, source: Path, output: OutputContainer) -> None:
        self._output = output
        self._open = ExitStack()
        self._packets: Iterator[_Packet] = iter(())
        with suppress(*_DAMAGE):
            if not source.is_dir():
                container = self._open.enter_context(open_container(source.absolute()))
                self._packets = self._prepare(container, source)
        self._waiting = self._next()

    def _prepare(self, container: InputContainer, path: Path) -> Iterator[_Packet]:
        """Sound packets for the output, timed from the first picture, in order."""
        stream = container.streams.best("audio")
        if not isinstance(stream, AudioStream) or stream.codec_context is None:
            return iter(())  # no sound, or none in a codec that FFmpeg knows
        video = video_stream(container, path)
        start = (video.start_time or 0) * (video.time_base or Fraction(0))
        frames = _decoded(container, stream, start)
        if stream.codec_context.codec.canonical_name in _COPIED:
            with suppress(av.FFmpegError):  # not all of a codec's variants, such as slow MP3
                return self._rehearsed(
                    lambda mp4: mp4.add_stream_from_template(stream),
                    lambda copy: _copied(container, stream, copy, start),
                )
        layout = "mono" if stream.codec_context.layout.nb_channels == 1 else "stereo"
        return self._rehearsed(
            lambda mp4: mp4.add_stream("aac", rate=_AAC_RATE, layout=layout),
            lambda encoder: _encoded(frames, encoder),
        )

    def _rehearsed(
        self,
        add_stream: Callable[[OutputContainer], AudioStream],
        make: Callable[[AudioStream], Iterator[_Packet]],
    ) -> Iterator[_Packet]:
        """Of the packets that are made for a stream those that the output takes."""
        rehearsal = Rehearsal(add_stream)
        self._open.callback(rehearsal.close)
        return filter(rehearsal.takes, make(add_stream(self._output)))

    def _next(self) -> "_Packet | None":
        try:
            return next(self._packets, None)
        except _DAMAGE:
            return None

    def write_until(self, time_ns: int | None) -> None:
        """Add what is heard up to a time of the pictures; None for all the rest."""
        while self._waiting is not None:
            packet = self._waiting
            if time_ns is not None and _seconds(packet) * NS_PER_S > time_ns:
                return
            self._output.mux(packet)
            self._waiting = self._next()

    def close(self) -> None:
        """Free the source."""
        self._open.close()


def _seconds(packet: _Packet) -> Fraction:
    return (packet.dts or 0) * packet.time_base


def _copied(
    container: InputContainer, stream: AudioStream, copy: AudioStream, start: Fraction
) -> Iterator[_Packet]:
    last = None
    for packet in read_packets(container, stream):
        # A muxer takes nothing else; players would skip it.
        if packet.dts is None or packet.pts is None or (last is not None and packet.dts <= last):
            continue
        last = packet.dts
        shift = round(start / packet.time_base)
        packet.pts, packet.dts = packet.pts - shift, packet.dts - shift
        packet.stream = copy
        yield packet


def _encoded(frames: Iterator[AudioFrame], encoder: AudioStream) -> Iterator[_Packet]:
    for frame in _resampled(frames, encoder):
        yield from encoder.encode(frame)
    yield from encoder.encode(None)


def _decoded(
    container: InputContainer, stream: AudioStream, start: Fraction
) -> Iterator[AudioFrame]:
    """Frames timed from the first picture."""
    for packet in read_packets(container, stream):
        try:
            frames = packet.decode()
        except av.FFmpegError:
            continue
        for frame in frames:
            if frame.pts is not None and frame.time_base is not None:
                # By samples: in other units the encoder's own blocks would get the same times.
                heard = (frame.pts * frame.time_base - start) * frame.sample_rate
                frame.pts, frame.time_base = round(heard), Fraction(1, frame.sample_rate)
            yield frame


def _resampled(frames: Iterator[AudioFrame], encoder: AudioStream) -> Iterator[AudioFrame]:
    """Frames as an encoder wants them, even where channels or rate change midway."""
    wanted = encoder.codec_context
    for _, alike in groupby(frames, _kind):
        resampler = AudioResampler(wanted.format, wanted.layout, wanted.sample_rate)
        for frame in chain(alike, (None,)):
            yield from resampler.resample(frame)


def _kind(frame: AudioFrame) -> tuple[str, str, int]:
    return frame.format.name, frame.layout.name, frame.sample_rate
