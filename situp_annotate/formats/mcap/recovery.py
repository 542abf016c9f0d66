"""Rescue what is whole of an MCAP file that was not finished, was cut off, or is damaged."""

from collections import ChainMap, Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Header, Message, Metadata, Schema
from mcap.writer import MCAP0_MAGIC, Writer

from situp_annotate.errors import OutputError, SitupError
from situp_annotate.formats.disk import is_there, writing_to
from situp_annotate.formats.mcap.file import McapFile
from situp_annotate.formats.mcap.records import (
    DamagedRecordError,
    McapContent,
    chunk_records,
    file_records,
    parse_record,
)
from situp_annotate.formats.staging import hidden_beside, refuse_existing

__all__ = ["Recovery", "recover_mcap"]


@dataclass(slots=True)
class Recovery:
    """What was rescued.

    Attributes
    ----------
    messages : Counter of str
        Number of messages by topic; topics without any are there too.
    first_ns, last_ns : int or None
        Earliest and latest time of a message; None without messages.
    attachments, metadata : int
        How many there are.
    finished : bool
        Whether the file had been finished.
    damaged : int
        Records that are there but not as they were written, or not to be understood without
        such; they are left out.
    """

    messages: Counter[str] = field(default_factory=Counter)
    first_ns: int | None = None
    last_ns: int | None = None
    attachments: int = 0
    metadata: int = 0
    finished: bool = False
    damaged: int = 0

    @property
    def empty(self) -> bool:
        """Whether there is nothing."""
        return not (self.messages.total() or self.attachments or self.metadata)

    def count(self, topic: str, time_ns: int) -> None:
        """Take note of a message."""
        self.messages[topic] += 1
        self.first_ns = time_ns if self.first_ns is None else min(self.first_ns, time_ns)
        self.last_ns = time_ns if self.last_ns is None else max(self.last_ns, time_ns)


class _Rescuer:
    """Copies records to a writer, which numbers schemas and channels anew.

    Parameters
    ----------
    writer : Writer
        Of the new file.
    definitions : list of Schema and Channel
        To fall back on where the file's own course does not bring one: chunks have checksums.
    """

    def __init__(self, writer: Writer, definitions: list[Schema | Channel]) -> None:
        self.recovery = Recovery()
        self._writer = writer
        self._schemas: ChainMap[int, Schema] = ChainMap({}, {})
        self._channels: ChainMap[int, Channel] = ChainMap({}, {})
        for definition in definitions:
            self._keep(definition, place=1)
        self._schema_ids: dict[int, int] = {0: 0}  # 0 stands for none
        self._channel_ids: dict[int, int] = {}

    def take(self, opcode: int, content: bytes) -> None:
        """Copy a record, if it bears data and can be read."""
        try:
            record = parse_record(opcode, content)
            inner = chunk_records(record) if isinstance(record, Chunk) else [record]
        except DamagedRecordError:
            self.recovery.damaged += 1
            return
        for each in inner:
            try:
                self._copy(each)
            except KeyError:
                self.recovery.damaged += 1  # its channel or schema was lost

    def _copy(self, record: McapContent | None) -> None:
        match record:
            case Schema():
                self._keep(record, place=0)
            case Channel():
                self._keep(record, place=0)
                self._channel_id(record.id)
            case Message():
                self._copy_message(record)
            case Attachment():
                self._copy_attachment(record)
            case Metadata():
                self._writer.add_metadata(record.name, record.metadata)
                self.recovery.metadata += 1

    def _keep(self, definition: Schema | Channel, *, place: int) -> None:
        """Keep the first of each id; the format wants all of an id to be the same."""
        if isinstance(definition, Schema):
            self._schemas.maps[place].setdefault(definition.id, definition)
        else:
            self._channels.maps[place].setdefault(definition.id, definition)

    def _copy_message(self, message: Message) -> None:
        self._writer.add_message(
            self._channel_id(message.channel_id),
            log_time=message.log_time,
            data=message.data,
            publish_time=message.publish_time,
            sequence=message.sequence,
        )
        self.recovery.count(self._channels[message.channel_id].topic, message.log_time)

    def _copy_attachment(self, attachment: Attachment) -> None:
        self._writer.add_attachment(
            attachment.create_time,
            attachment.log_time,
            attachment.name,
            attachment.media_type,
            attachment.data,
        )
        self.recovery.attachments += 1

    def _channel_id(self, old_id: int) -> int:
        if old_id not in self._channel_ids:
            channel = self._channels[old_id]
            self._channel_ids[old_id] = self._writer.register_channel(
                channel.topic,
                channel.message_encoding,
                self._schema_id(channel.schema_id),
                channel.metadata,
            )
            self.recovery.messages[channel.topic] += 0
        return self._channel_ids[old_id]

    def _schema_id(self, old_id: int) -> int:
        if old_id not in self._schema_ids:
            schema = self._schemas[old_id]
            self._schema_ids[old_id] = self._writer.register_schema(
                schema.name, schema.encoding, schema.data
            )
        return self._schema_ids[old_id]


def recover_mcap(source: Path, target: Path, *, overwrite: bool = False) -> Recovery:
    """Write what is whole of an MCAP file to a new one: complete, indexed, with statistics.

    Messages keep their order, channels, times and bytes. Damaged chunks and attachments are left
    out; where a record is cut off, or says a length that cannot be, the file is taken to end.

    Parameters
    ----------
    source : Path
        Any MCAP file, by whatever tool: unfinished, cut off, damaged or sound.
    target : Path
        The file to write.
    overwrite : bool
        Replace a file that is there.

    Returns
    -------
    Recovery
        What was rescued.

    Raises
    ------
    SitupError
        If the source cannot be read, is no MCAP, or has nothing to rescue.
    OutputError
        If the target is there already, is the source, or cannot be written.
    """
    try:
        file = source.open("rb")
    except OSError as error:
        raise SitupError(f"{source}: this file cannot be read: {error.strerror}.") from error
    with file:
        if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            raise SitupError(
                f"{source}: this is no MCAP file, for it does not begin as one; name a file such "
                "as annotations.mcap.partial."
            )
        with writing_to(target):
            # TARGET.partial may be the very file to be rescued.
            partial = hidden_beside(target, "rescue")
            _refuse(source, target, partial, overwrite=overwrite)
            return _rescue(file, target, partial)


def _refuse(source: Path, target: Path, partial: Path, *, overwrite: bool) -> None:
    for place in (target, partial):
        if is_there(place) and place.samefile(source):
            raise OutputError(
                f"{place}: this is the file to be rescued, which would be lost; choose another "
                "with --output."
            )
    refuse_existing([target], overwrite=overwrite)


def _rescue(file: BinaryIO, target: Path, partial: Path) -> Recovery:
    header, definitions = _outside_of_chunks(file)
    with McapFile(target, partial=partial, profile=header.profile, library=header.library) as log:
        rescuer = _Rescuer(log.writer, definitions)
        opcode = None
        for opcode, content in _records(file):
            rescuer.take(opcode, content)
        recovery = rescuer.recovery
        recovery.finished = opcode == Opcode.FOOTER and file.read() == MCAP0_MAGIC
        if recovery.empty:
            raise SitupError(
                f"{file.name}: not one chunk of this MCAP is whole, so there is nothing to rescue."
            )
    return recovery


def _records(file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """As of `file_records`; so that what cannot be read is not taken for what cannot be written."""
    try:
        yield from file_records(file)
    except OSError as error:
        raise SitupError(f"{file.name}: cannot be read: {error.strerror or error}.") from error


def _outside_of_chunks(file: BinaryIO) -> tuple[Header, list[Schema | Channel]]:
    """The header, and the schemas and channels that stand outside of chunks."""
    header = Header(profile="", library="")
    definitions: list[Schema | Channel] = []
    for opcode, content in _records(file):
        if opcode in (Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL):
            with suppress(DamagedRecordError):
                match parse_record(opcode, content):
                    case Header() as header:
                        pass
                    case Schema() | Channel() as definition:
                        definitions.append(definition)
    return header, definitions
