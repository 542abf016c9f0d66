"""An MCAP file that appears whole: beside its place until it is finished."""

import os
from pathlib import Path
from types import TracebackType
from typing import Self

from google.protobuf.timestamp_pb2 import Timestamp
from mcap.writer import CompressionType, Writer

from situp_annotate.types import NS_PER_S

__all__ = ["PARTIAL_SUFFIX", "McapFile", "timestamp"]

PARTIAL_SUFFIX = ".partial"


def timestamp(time_ns: int) -> Timestamp:
    """Turn nanoseconds into protobuf's time."""
    seconds, nanos = divmod(time_ns, NS_PER_S)
    return Timestamp(seconds=seconds, nanos=nanos)


class McapFile:
    """Writes ``PATH.partial``, and makes it PATH once it is finished and on the disk.

    A context manager. Leaving it by an exception removes what there is; being killed leaves it,
    up to the writer's last flush, to `recover_mcap`.

    Parameters
    ----------
    path : Path
        The file to be.
    profile, library : str
        Go into the header.

    Attributes
    ----------
    writer : Writer
        Takes schemas, channels, messages, attachments and metadata; started.
    """

    def __init__(self, path: Path, *, profile: str = "", library: str = "situp-annotate") -> None:
        self._path = path
        self._partial = path.with_name(path.name + PARTIAL_SUFFIX)
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
            with self._file:
                if exc_type is None:
                    self.writer.finish()  # type: ignore[no-untyped-call]
                    self._file.flush()
                    os.fsync(self._file.fileno())
            if exc_type is None:
                self._partial.replace(self._path)
        finally:
            self._partial.unlink(missing_ok=True)
