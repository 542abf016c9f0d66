"""What every output of a video has in common: it takes frames with their labels, one by one."""

from collections.abc import Sequence
from contextlib import suppress
from types import TracebackType
from typing import IO, Protocol, Self

from situp_annotate.types import Frame, TrackPoint

__all__ = ["Sink", "close_file"]


class Sink(Protocol):
    """One output file in the making.

    A context manager: leaving it normally finishes the file; leaving it by an exception only
    frees what it holds, since the pipeline throws the unfinished file away. Sinks write into
    the pipeline's work folder and need not care for atomic replacement, nor for how to tell what
    the disk refuses: their ``OSError`` is as good as any.
    """

    @property
    def wants_pictures(self) -> bool:
        """Whether frames must come with their pictures.

        If no sink wants them, frames come with images of 0 × 0 pixels, and nothing is decoded.
        """

    def write(self, frame: Frame, points: Sequence[TrackPoint]) -> None:
        """Add one frame and the labels on it (none on a frame without objects).

        Frames come in order; points are sorted by track id, at most one a track.
        """

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None: ...


def close_file(file: IO[str], exc_type: type[BaseException] | None) -> None:
    """Close a sink's file; silently after a failure, which a full disk must not hide.

    Parameters
    ----------
    file : file object
        To be closed.
    exc_type : type or None
        As of ``__exit__``.

    Raises
    ------
    OSError
        If there was no failure, and what is left in the buffer cannot be written.
    """
    if exc_type is None:
        file.close()
    else:
        with suppress(OSError):
            file.close()
