"""H.264 video out, with the true time of every frame."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from fractions import Fraction
from io import FileIO
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

import av

from situp_annotate.errors import OutputError
from situp_annotate.types import Image
from situp_annotate.video.background import Background
from situp_annotate.video.sound import SoundTrack
from situp_annotate.video.x264 import TICKS_PER_SECOND, set_up_encoder, ticks, yuv_frame

if TYPE_CHECKING:
    from typing_extensions import Buffer

__all__ = ["H264Writer"]

_SECONDS_BETWEEN_KEYFRAMES = 2
"""So that a browser that jumps somewhere has little to decode."""

_RATES = (Fraction(1, 20_000), Fraction(TICKS_PER_SECOND))
"""Pictures a second: an mp4 has 31 bits for the ticks that one stands, and it is one at least."""


class _WholeFile(FileIO):
    """Takes all or raises an error. FFmpeg does not look how much a full disk has taken.

    Nor does its binding close a file of its own whose header could not be written.
    """

    def write(self, data: "Buffer", /) -> int:
        rest = memoryview(data).cast("B")
        size = rest.nbytes
        while rest:
            rest = rest[super().write(rest) :]
        return size


class H264Writer:
    """Writes an mp4 that plays in browsers: H.264, yuv420p, index in front (faststart).

    One encoder thread, so that the same frames give the same bytes. Pictures of odd size are
    made even by repeating the last row or column, which yuv420p demands.

    Parameters
    ----------
    path : Path
        File to write.
    width, height : int
        Size of the pictures.
    frame_rate : Fraction
        Average; only a hint to the encoder.
    crf : int
        Quality from 1 (best) to 51 (worst); 0 would be lossless, which browsers cannot play.
    preset : str
        x264's trade of speed for size, such as ``"ultrafast"``.
    pixel_aspect_ratio : Fraction
        Width of a pixel over its height.
    sound : Path, optional
        The video whose sound to take along, if it has any.
    background : bool
        Whether to encode in a thread of its own, a few pictures behind. A picture must not be
        changed any more then, and a failure is raised by a later call. The bytes are the same.
    """

    def __init__(
        self,
        path: Path,
        *,
        width: int,
        height: int,
        frame_rate: Fraction,
        crf: int = 23,
        preset: str = "ultrafast",
        pixel_aspect_ratio: Fraction = Fraction(1),
        sound: Path | None = None,
        background: bool = False,
    ) -> None:
        lowest, highest = _RATES
        rate = min(max(frame_rate, lowest), highest)
        self._path = path
        self._file = _WholeFile(path.absolute(), "wb")
        self._container = av.open(
            self._file, "w", format="mp4", container_options={"movflags": "+faststart"}
        )
        self._stream = self._container.add_stream(
            "libx264",
            rate=rate.limit_denominator(100_000),
            # "ultrafast" alone does without deblocking, and smooth areas fall into squares. With
            # B-frames and a variable frame rate the file would end before its last pictures.
            options={"crf": str(crf), "preset": preset, "bf": "0", "x264-params": "deblock=0,0"},
        )
        context = self._stream.codec_context
        set_up_encoder(context, width=width, height=height)
        context.gop_size = max(round(_SECONDS_BETWEEN_KEYFRAMES * rate), 1)
        context.sample_aspect_ratio = pixel_aspect_ratio
        self._last_tick = -1
        self._usual_ticks = max(round(TICKS_PER_SECOND / rate), 1)
        self._sound = SoundTrack(sound, self._container) if sound is not None else None
        self._background = Background(self._write) if background else None

    def write(self, image: Image, pts_ns: int) -> None:
        """Add a picture, (height, width) or (height, width, 3) in the order B, G, R.

        Parameters
        ----------
        image : Image
            The picture.
        pts_ns : int
            Its time in nanoseconds, later than the one before; kept to 1/90000 s.

        Raises
        ------
        OSError
            If the disk refuses.
        OutputError
            If the picture cannot be encoded.
        """
        (self._background or self._write)(image, pts_ns)

    def _write(self, image: Image, pts_ns: int) -> None:
        frame = yuv_frame(image)
        self._last_tick = max(ticks(pts_ns), self._last_tick + 1)
        frame.pts, frame.time_base = self._last_tick, Fraction(1, TICKS_PER_SECOND)
        frame.duration = self._usual_ticks
        self._encode(frame, pts_ns)

    def _encode(self, frame: av.VideoFrame | None, pts_ns: int | None) -> None:
        """Encode a picture and add what is heard up to its time; None ends both."""
        with self._naming_file():
            self._container.mux(self._stream.encode(frame))
            if self._sound is not None:
                self._sound.write_until(pts_ns)

    @contextmanager
    def _naming_file(self) -> Iterator[None]:
        """Let pass what the disk refuses, and give all else that FFmpeg refuses a name."""
        try:
            yield
        except OSError:
            raise
        except av.FFmpegError as error:
            raise OutputError(
                f"{self._path.name}: this video cannot be encoded: {error.strerror}."
            ) from error

    def _finish(self) -> None:
        """Encode what is waiting, and write the index."""
        if self._background is not None:
            self._background.finish()
        self._encode(None, None)
        with self._naming_file():
            self._container.close()
        self._file.close()

    def _free(self) -> None:
        if self._background is not None:
            self._background.close()
        if self._sound is not None:
            self._sound.close()
        # In this order, or the index would be written to what is thrown away.
        with suppress(OSError):
            self._file.close()
        with suppress(av.FFmpegError, OSError, ValueError):
            self._container.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            if exc_type is None:
                self._finish()
        finally:
            self._free()
