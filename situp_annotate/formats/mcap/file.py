"""An MCAP file that appears whole: beside its place until it is finished."""

from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from google.protobuf.timestamp_pb2 import Timestamp
from mcap.writer import CompressionType, Writer

from situp_annotate.formats.disk import sync
from situp_annotate.types import NS_PER_S

__all__ = ["McapFile", "timestamp"]


def timestamp(time_ns: int) -> Timestamp:
    """Turn nanoseconds into protobuf's time."""
    seconds, nanos = divmod(time_ns, NS_PER_S)
    return Timestamp(seconds=seconds, nanos=nanos)


class McapFile:
    """Writes ``PATH.partial``, and makes it PATH once it is finished and on the disk.

    A context manager. Leaving it by an exception removes what there is; being killed leaves it,
    up to the writer's last flush, to `recover_mcap`. What the disk refuses is an ``OSError``.

    Parameters
    ----------
    path : Path
        The file to be.
    partial : Path, optional
        Where it is until then, in the same folder, instead of ``PATH.partial``.
    profile, library : str
        Go into the header.

    Attributes
    ----------
    writer : Writer
        Takes schemas, channels, messages, attachments and metadata; started.
    """

    def __init__(
        self,
        path: Path,
        *,
        partial: Path | None = None,
        profile: str = "",
        library: str = "situp-annotate",
    ) -> None:
        self._path = path
        self._partial = partial or path.with_name(f"{path.name}.partial")
        self._file = self._partial.open("wb")
        self.writer = Writer(self._file, compression=CompressionType.ZSTD)
        self.writer.start(profile=profile, library=library)

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
            with suppress(OSError):  # a full disk has been told of by now
                self._file.close()
            with suppress(OSError):
                self._partial.unlink()

    def _finish(self) -> None:
        self.writer.finish()  # type: ignore[no-untyped-call]
        self._file.close()
        sync(self._partial)
        self._partial.replace(self._path)
        sync(self._path.parent)
