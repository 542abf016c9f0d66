"""Find out beforehand which packets an mp4 takes."""

from collections.abc import Callable
from contextlib import suppress
from io import SEEK_CUR, SEEK_SET, RawIOBase
from typing import TYPE_CHECKING

import av
from av.audio.stream import AudioStream
from av.container import OutputContainer
from av.packet import Packet

if TYPE_CHECKING:
    from typing_extensions import Buffer

__all__ = ["Rehearsal"]


class Rehearsal:
    """An mp4 of a single stream that is written nowhere.

    FFmpeg keeps the packets of several streams back to put them in order. One that it does not
    take fails when its turn has come: at a packet of another stream, or at the end, and then all
    that follow are lost. Where there is but one stream, a packet's turn is at once.

    Parameters
    ----------
    add_stream : callable
        Adds the stream to a file.

    Raises
    ------
    av.FFmpegError
        If an mp4 cannot hold such a stream.
    """

    def __init__(self, add_stream: Callable[[OutputContainer], AudioStream]) -> None:
        self._add_stream = add_stream
        self._container, self._stream = self._begin()
        self._can_end: bool | None = None

    def _begin(self) -> tuple[OutputContainer, AudioStream]:
        container = av.open(_Nowhere(), "w", format="mp4")
        stream = self._add_stream(container)
        container.start_encoding()
        return container, stream

    def takes(self, packet: "Packet[AudioStream]") -> bool:
        """Whether the file that this is the rehearsal of takes the packet, after those before."""
        if self._can_end is None:
            self._can_end = self._can_end_after(packet)
        return bool(self._can_end) and _put(packet, self._container, self._stream)

    def _can_end_after(self, packet: "Packet[AudioStream]") -> bool | None:
        """Whether an mp4's index can tell of the stream; None while it is without a packet."""
        container, stream = self._begin()
        taken = _put(packet, container, stream)
        try:
            container.close()
        except av.FFmpegError:
            return False if taken else None
        return True if taken else None

    def close(self) -> None:
        """Free the memory."""
        with suppress(av.FFmpegError):
            self._container.close()


def _put(packet: "Packet[AudioStream]", container: OutputContainer, stream: AudioStream) -> bool:
    place = packet.stream
    packet.stream = stream
    try:
        container.mux(packet)
    except av.FFmpegError:
        return False
    finally:
        packet.stream = place
    return True


class _Nowhere(RawIOBase):
    """A file that forgets what is written, and only knows where it stands."""

    def __init__(self) -> None:
        self._position = self._end = 0

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._position

    def seek(self, offset: int, whence: int = SEEK_SET, /) -> int:
        start = {SEEK_SET: 0, SEEK_CUR: self._position}.get(whence, self._end)
        self._position = start + offset
        return self._position

    def write(self, data: "Buffer", /) -> int:
        count = memoryview(data).nbytes
        self._position += count
        self._end = max(self._end, self._position)
        return count
