"""Walk through a video backward, in bounded memory, once it has been read forward."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from situp_annotate.errors import VideoError
from situp_annotate.types import Frame, VideoInfo
from situp_annotate.video.file_rewinder import FileRewinder
from situp_annotate.video.image_folder import ImageFolderDecoder

__all__ = ["Rewinder", "rewind"]


class Rewinder:
    """Stretches of a video, backward: a context manager.

    Parameters
    ----------
    path : Path
        The file or folder that was read forward.
    info : VideoInfo
        What `open_video` said of it.
    times_ns : sequence of int
        ``pts_ns`` of every frame of the forward pass, by index.
    budget_bytes : int
        About how many bytes of decoded pictures may be held, in the decoder's own pixel format;
        one picture always is. The decoder holds up to some twenty more for itself. Frames do not
        depend on the budget, only speed does.

    Raises
    ------
    VideoMissingError
        If the file or folder is not there any more.
    VideoFormatError
        If it is no video any more.
    VideoError
        If it gives no frame any more.

    Notes
    -----
    Frames have the same indices, times and pixels as in the forward pass, whichever decoder that
    used. Where data are damaged, the decoder fills gaps with what it has decoded before; there,
    pixels may differ.
    """

    def __init__(
        self, path: Path, info: VideoInfo, times_ns: Sequence[int], *, budget_bytes: int
    ) -> None:
        place = path.absolute()  # FFmpeg would read a relative "concat:a|b" as a protocol
        self._times_ns = times_ns
        self._source: ImageFolderDecoder | FileRewinder
        if info.decoder == ImageFolderDecoder.name:
            self._source = _open_folder(place, info, len(times_ns))
        else:
            self._source = FileRewinder(place, info, times_ns, budget_bytes=budget_bytes)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the file."""
        self._source.close()

    @property
    def peak_bytes(self) -> int:
        """Most bytes of decoded pictures that were held at one time; 0 for a folder."""
        return self._source.peak_bytes if isinstance(self._source, FileRewinder) else 0

    def walk(self, start: int, stop: int) -> Iterator[Frame]:
        """Yield the frames ``stop - 1``, ``stop - 2``, … down to `start`.

        Parameters
        ----------
        start, stop : int
            Indices, ``0 <= start <= stop <= len(times_ns)``; no frame when they are equal.

        Raises
        ------
        ValueError
            If the stretch is not in the video.
        VideoError
            If a frame of the forward pass is not found again.
        """
        if not 0 <= start <= stop <= len(self._times_ns):
            raise ValueError(
                f"Frames {start} to {stop} (exclusive) are no stretch of "
                f"{len(self._times_ns)} frames."
            )
        if isinstance(self._source, FileRewinder):
            return self._source.walk(start, stop)
        return self._walk_folder(self._source, start, stop)

    def _walk_folder(self, folder: ImageFolderDecoder, start: int, stop: int) -> Iterator[Frame]:
        for index in range(stop - 1, start - 1, -1):
            yield Frame(index, self._times_ns[index], folder.read(index))


def _open_folder(place: Path, info: VideoInfo, count: int) -> ImageFolderDecoder:
    folder = ImageFolderDecoder(place, max_pixels=info.width * info.height)
    if len(folder.paths) < count:
        raise VideoError(
            f"{place}: the folder holds {len(folder.paths)} pictures where {count} were read "
            "forward; do not change it while it is annotated."
        )
    return folder


def rewind(
    path: Path,
    info: VideoInfo,
    times_ns: Sequence[int],
    start: int,
    stop: int,
    *,
    budget_bytes: int,
) -> Iterator[Frame]:
    """Yield the frames ``stop - 1`` to `start` of a video that has been read forward.

    A generator: the file is opened for the first frame, and freed after the last one or when the
    generator is closed. For several stretches of a video use one `Rewinder`, whose parameters
    and errors are the same.

    Parameters
    ----------
    path, info, times_ns, budget_bytes
        As of `Rewinder`.
    start, stop : int
        As of `Rewinder.walk`.
    """
    with Rewinder(path, info, times_ns, budget_bytes=budget_bytes) as rewinder:
        yield from rewinder.walk(start, stop)
