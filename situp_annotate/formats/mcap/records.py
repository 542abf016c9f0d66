"""The records of an MCAP file, read so that neither cuts nor damage do more harm than they must."""

import struct
import zlib
from collections.abc import Callable, Iterator
from io import BytesIO
from typing import BinaryIO, TypeAlias

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Header, Message, Metadata, Schema
from mcap.stream_reader import get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC

__all__ = ["DamagedRecordError", "McapContent", "chunk_records", "file_records", "parse_record"]

McapContent: TypeAlias = Header | Schema | Channel | Message | Chunk | Attachment | Metadata
"""Records that bear data; all others can be made of these."""

_HEAD = struct.Struct("<BQ")
"""Of every record: what it is, and how many bytes follow."""

_MESSAGE_HEAD_BYTES = 22
"""Of a message, before its data."""

# What the mcap package, and the decompressors beneath it, raise of bytes that are no such record.
_UNREADABLE = (
    EOFError,
    McapError,
    MemoryError,
    OverflowError,
    RuntimeError,
    ValueError,
    struct.error,
    zstandard.ZstdError,
)


class DamagedRecordError(Exception):
    """A record is not as it was written."""


def _split(stream: BinaryIO, size: int) -> Iterator[tuple[int, bytes]]:
    """Cut bytes into records, up to the end or to where one is not whole."""
    while len(head := stream.read(_HEAD.size)) == _HEAD.size:
        opcode, length = _HEAD.unpack(head)
        if length > size - stream.tell():
            return
        yield opcode, stream.read(length)


def file_records(file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Cut a file into records.

    Yields
    ------
    tuple of int and bytes
        Opcode and content of each record that is whole, up to the footer or the first that is
        cut off.
    """
    size = file.seek(0, 2)
    file.seek(len(MCAP0_MAGIC))
    for opcode, content in _split(file, size):
        yield opcode, content
        if opcode == Opcode.FOOTER:
            return


def _read_attachment(stream: ReadDataStream, content: bytes) -> Attachment:
    (crc,) = struct.unpack("<I", content[-4:])
    if crc not in (0, zlib.crc32(content[:-4])):
        raise ValueError("The attachment's checksum does not fit.")
    attachment: Attachment = Attachment.read(stream)
    return attachment


def _read_message(stream: ReadDataStream, content: bytes) -> Message:
    if len(content) < _MESSAGE_HEAD_BYTES:
        raise ValueError("The message is too short.")
    message: Message = Message.read(stream, len(content))
    return message


_READERS: dict[int, Callable[[ReadDataStream, bytes], McapContent]] = {
    Opcode.HEADER: lambda stream, _: Header.read(stream),
    Opcode.SCHEMA: lambda stream, _: Schema.read(stream),
    Opcode.CHANNEL: lambda stream, _: Channel.read(stream),
    Opcode.MESSAGE: _read_message,
    Opcode.CHUNK: lambda stream, _: Chunk.read(stream),
    Opcode.ATTACHMENT: _read_attachment,
    Opcode.METADATA: lambda stream, _: Metadata.read(stream),
}


def parse_record(opcode: int, content: bytes) -> McapContent | None:
    """Read one record; None when it is of a kind that bears no data of its own.

    Raises
    ------
    DamagedRecordError
        If it cannot be read, or an attachment's checksum does not fit.
    """
    reader = _READERS.get(opcode)
    if reader is None:
        return None
    try:
        return reader(ReadDataStream(BytesIO(content)), content)
    except _UNREADABLE as error:
        raise DamagedRecordError from error


def chunk_records(chunk: Chunk) -> list[McapContent]:
    """Unpack a chunk: all schemas, channels and messages, in order.

    Raises
    ------
    DamagedRecordError
        If it cannot be unpacked, its checksum does not fit, or any of it is not whole.
    """
    try:
        stream, size = get_chunk_data_stream(chunk, validate_crc=True)
        pieces = list(_split(BytesIO(stream.read(size)), size))
    except _UNREADABLE as error:
        raise DamagedRecordError from error
    if sum(_HEAD.size + len(content) for _, content in pieces) != size:
        raise DamagedRecordError
    records = [parse_record(*piece) for piece in pieces]
    return [each for each in records if isinstance(each, Schema | Channel | Message)]
