"""What an MCAP log holds, and whether it is whole."""

import struct
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    Header,
    McapRecord,
    Message,
    Metadata,
    Schema,
    Statistics,
)
from mcap.summary import Summary
from mcap.writer import MCAP0_MAGIC

from situp_annotate.formats.mcap.records import (
    DamagedRecordError,
    chunk_records,
    file_records,
    parse_record,
)
from situp_annotate.inspection.progress import OnProgress, reporting
from situp_annotate.inspection.report import FileReport, Grade, Remark, count
from situp_annotate.types import NS_PER_S

__all__ = ["inspect_mcap"]

_PICTURES = frozenset({"CompressedImage", "CompressedVideo", "Image", "RawImage"})
_MAX_RECORD = 2**30
_MAX_LISTED = 30
_MAX_CHANNELS = 10_000
_SUMMARY_READERS: dict[int, Callable[[ReadDataStream], McapRecord]] = {
    Opcode.CHUNK_INDEX: ChunkIndex.read,
    Opcode.STATISTICS: Statistics.read,
}


@dataclass(slots=True)
class _Survey:
    """Running figures over the records."""

    library: str = ""
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    messages: Counter[int] = field(default_factory=Counter)
    first_ns: int | None = None
    last_ns: int | None = None
    chunks: int = 0
    chunk_indexes: int = 0
    attachments: list[str] = field(default_factory=list)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    statistics: Statistics | None = None
    finished: bool = False
    damaged: int = 0

    def add(self, record: McapRecord | None) -> None:
        """Take in one record."""
        if isinstance(record, Message):
            self.messages[record.channel_id] += 1
            self._widen(record.log_time, record.log_time)
        elif isinstance(record, Schema) and len(self.schemas) < _MAX_CHANNELS:
            self.schemas[record.id] = record
        elif isinstance(record, Channel) and len(self.channels) < _MAX_CHANNELS:
            self.channels[record.id] = record
        elif isinstance(record, Header):
            self.library = record.library
        elif isinstance(record, Attachment | AttachmentIndex):
            if record.name not in self.attachments and len(self.attachments) < _MAX_LISTED:
                self.attachments.append(record.name)
        elif isinstance(record, Metadata) and len(self.metadata) < _MAX_LISTED:
            self.metadata[record.name] = dict(record.metadata)
        elif isinstance(record, ChunkIndex):
            self.chunk_indexes += 1
        elif isinstance(record, Statistics):
            self.statistics = record

    def take_summary(self, summary: Summary) -> None:
        """Take in what stands at the file's end instead of the records themselves."""
        for record in (
            *summary.schemas.values(),
            *summary.channels.values(),
            *summary.attachment_indexes,
            *summary.chunk_indexes,
        ):
            self.add(record)
        statistics = summary.statistics
        if statistics is not None:
            self.statistics = statistics
            self.chunks = statistics.chunk_count
            self.messages.update(statistics.channel_message_counts)
            if statistics.message_count:
                self._widen(statistics.message_start_time, statistics.message_end_time)
        self.finished = True

    def _widen(self, first_ns: int, last_ns: int) -> None:
        self.first_ns = first_ns if self.first_ns is None else min(self.first_ns, first_ns)
        self.last_ns = last_ns if self.last_ns is None else max(self.last_ns, last_ns)

    def schema_name(self, channel: Channel) -> str:
        """Name of the schema of a channel's messages."""
        schema = self.schemas.get(channel.schema_id)
        return schema.name if schema else "no schema"


def _read_all(file: BinaryIO) -> _Survey:
    """Read every record and verify the chunks' checksums; damage is counted and passed over."""
    survey = _Survey()
    for opcode, content in file_records(file):
        survey.finished = opcode == Opcode.FOOTER
        try:
            if opcode in _SUMMARY_READERS:
                survey.add(_SUMMARY_READERS[opcode](ReadDataStream(BytesIO(content))))
                continue
            record = parse_record(opcode, content)
            inner = chunk_records(record) if isinstance(record, Chunk) else [record]
        except (DamagedRecordError, McapError, struct.error, ValueError):
            survey.damaged += 1
            continue
        survey.chunks += isinstance(record, Chunk)
        for each in inner:
            survey.add(each)
    survey.finished = survey.finished and file.read() == MCAP0_MAGIC
    return survey


def _read_summary(file: BinaryIO) -> _Survey | None:
    """Read what stands at the end of the file; None where that cannot be done."""
    survey = _Survey()
    try:
        reader = SeekingReader(file, record_size_limit=_MAX_RECORD)
        survey.library = reader.get_header().library
        summary = reader.get_summary()
        if summary is None:
            return None
        survey.take_summary(summary)
        for metadata in reader.iter_metadata():
            survey.add(metadata)
    # A damaged end makes the reader raise whatever it likes; reading all says what is wrong.
    except Exception:  # noqa: BLE001
        return None
    return survey


def inspect_mcap(
    path: Path, *, quick: bool = False, on_progress: OnProgress | None = None
) -> FileReport:
    """Look at an MCAP log.

    Parameters
    ----------
    path : Path
        A file that begins as MCAP does.
    quick : bool
        Whether to leave it at the summary at the file's end where there is one; else all is read
        and its checksums are verified.
    on_progress : callable, optional
        Is told how many bytes are read.
    """
    with path.open("rb") as file:
        survey = _read_summary(file) if quick else None
        if survey is None:
            file.seek(0)
            with reporting(file.tell, path.stat().st_size, on_progress):
                survey = _read_all(file)
    total = survey.messages.total()
    state = "" if survey.finished and not survey.damaged else ", unfinished or damaged"
    title = f"MCAP log, {count(len(survey.channels), 'channel')}, {count(total, 'message')}{state}"
    return FileReport(path, "mcap", title, tuple(_facts(survey)), tuple(_remarks(path, survey)))


def _facts(survey: _Survey) -> Iterator[tuple[str, str]]:
    yield "written by", survey.library or "unknown"
    if survey.first_ns is not None and survey.last_ns is not None:
        span = (survey.last_ns - survey.first_ns) / NS_PER_S
        first_s, last_s = survey.first_ns / NS_PER_S, survey.last_ns / NS_PER_S
        yield "time", f"{first_s:.3f} s to {last_s:.3f} s, {span:.3f} s long"
    yield "chunks", f"{survey.chunks}, {survey.chunk_indexes} indexed"
    for channel in list(survey.channels.values())[:_MAX_LISTED]:
        number = count(survey.messages[channel.id], "message")
        kind = f"{survey.schema_name(channel)}, {channel.message_encoding or 'no encoding'}"
        yield channel.topic, f"{number} of {kind}"
    if survey.attachments:
        yield "attachments", ", ".join(survey.attachments)
    for name, record in survey.metadata.items():
        shown = ", ".join(
            f"{key} {value}" for key, value in sorted(record.items()) if key in _SHOWN
        )
        yield f"metadata {name}", shown or count(len(record), "entry", "entries")


_SHOWN = frozenset({"version", "source", "frame_count", "frame_rate", "video"})


def _remarks(path: Path, survey: _Survey) -> Iterator[Remark]:
    if survey.damaged or not survey.finished:
        yield _broken(path, survey)
        return
    if survey.statistics is not None and (
        survey.statistics.message_count != survey.messages.total()
    ):
        yield Remark(
            Grade.WARNING,
            "statistics",
            f"The summary speaks of {count(survey.statistics.message_count, 'message')}, "
            f"{survey.messages.total()} are there; viewers may show a wrong length. "
            f"`situp-annotate recover {path}` writes a copy with a right one.",
        )
    elif survey.chunks and survey.chunk_indexes < survey.chunks:
        yield Remark(
            Grade.WARNING,
            "index",
            "There is no index, or not of all chunks: viewers read the whole file before they show "
            f"anything, and some refuse it. `situp-annotate recover {path}` writes a copy with "
            "one.",
        )
    if not survey.messages.total():
        yield Remark(Grade.WARNING, "empty", "There is no message in it; nothing can be shown.")
    yield from _pictures(survey)


def _broken(path: Path, survey: _Survey) -> Remark:
    total = survey.messages.total()
    rescue = (
        f"`situp-annotate recover {path}` saves the {count(total, 'message')} that are whole."
        if total
        else "No message in it is whole."
    )
    if survey.finished:
        what = f"{count(survey.damaged, 'record')} in it cannot be read, or not as written"
        kind, effect = "damaged", "Viewers stop there or show nothing."
    else:
        what = "The log was not finished when it was written, or was cut off in copying"
        kind, effect = "unfinished", "Viewers refuse it."
    return Remark(Grade.PROBLEM, kind, f"{what}. {effect} {rescue}")


def _pictures(survey: _Survey) -> Iterator[Remark]:
    numbers: defaultdict[str, list[int]] = defaultdict(list)
    for channel in survey.channels.values():
        short = survey.schema_name(channel).replace("/", ".").rpartition(".")[2]
        numbers["Picture" if short in _PICTURES else short].append(survey.messages[channel.id])
    boxes, pictures = numbers["ImageAnnotations"], numbers["Picture"]
    if boxes and not pictures:
        yield Remark(
            Grade.NOTE,
            "no_picture",
            "There are boxes but no pictures in it: a viewer shows the boxes only over pictures "
            "from another file with the same times.",
        )
    elif len(boxes) == len(pictures) == 1 and boxes != pictures:
        yield Remark(
            Grade.WARNING,
            "pictures_differ",
            f"There are {count(pictures[0], 'picture')} and {count(boxes[0], 'set')} of boxes: "
            "some pictures come without boxes, or some boxes without their picture.",
        )
