"""Whatever becomes of an MCAP file: what is whole of it is rescued, and nothing else is."""

import contextlib
import errno
import io
import subprocess
import sys
import tempfile
from itertools import islice
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from situp_annotate.errors import OutputError, SitupError
from situp_annotate.formats.mcap.records import file_records
from situp_annotate.formats.mcap.recovery import recover_mcap

MESSAGES = 300
TOPICS = ("/camera/video", "/camera/annotations", "/empty")


def log_bytes(*, finished=True, compression=CompressionType.ZSTD, chunking=True, extras=True):
    """An MCAP in several chunks, and where each of them ends."""
    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=2_000, compression=compression, use_chunking=chunking)
    writer.start(profile="", library="a library")
    schema = writer.register_schema("a.Schema", "protobuf", b"schema")
    channels = [writer.register_channel(topic, "protobuf", schema) for topic in TOPICS]
    ends = []
    for index in range(MESSAGES):
        writer.add_message(channels[index % 2], index * 10, payload(index), index * 10, index)
        if index % 50 == 49:
            writer.flush()
            ends.append(stream.tell())
    if extras:
        writer.add_attachment(7, 8, "a.csv", "text/csv", b"1,2,3\n" * 40)
        writer.add_metadata("record", {"key": "value"})
    if finished:
        writer.finish()
    return stream.getvalue(), ends


def payload(index):
    return bytes((index * step) % 256 for step in range(40 + index % 7))


def whole_log():
    return log_bytes()[0]


WHOLE = whole_log()


def rescue(content, target):
    source = target.with_name("source.mcap.partial")
    source.write_bytes(content)
    return recover_mcap(source, target, overwrite=True)


def read(path):
    """All messages in the file's order: (topic, time, sequence, data)."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        found = [
            (channel.topic, message.log_time, message.sequence, message.data)
            for schema, channel, message in reader.iter_messages(log_time_order=False)
        ]
        summary = reader.get_summary()
    assert summary.statistics.message_count == len(found)
    return found


def expected(indices):
    return [(TOPICS[index % 2], index * 10, index, payload(index)) for index in indices]


def test_a_sound_file_comes_back_whole(tmp_path):
    target = tmp_path / "new.mcap"
    recovery = rescue(WHOLE, target)
    assert (recovery.finished, recovery.damaged) == (True, 0)
    assert recovery.messages == {"/camera/video": 150, "/camera/annotations": 150, "/empty": 0}
    assert (recovery.first_ns, recovery.last_ns) == (0, 2990)
    assert (recovery.attachments, recovery.metadata) == (1, 1)
    assert read(target) == expected(range(MESSAGES))
    with target.open("rb") as file:
        reader = make_reader(file)
        (attachment,) = reader.iter_attachments()
        (metadata,) = reader.iter_metadata()
        (schema,) = reader.get_summary().schemas.values()
        assert reader.get_header().library == "a library"
    assert (attachment.create_time, attachment.log_time) == (7, 8)
    assert (attachment.name, attachment.data) == ("a.csv", b"1,2,3\n" * 40)
    assert metadata.metadata == {"key": "value"}
    assert (schema.name, schema.encoding, schema.data) == ("a.Schema", "protobuf", b"schema")


@pytest.mark.parametrize(
    "compression", [CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD]
)
@pytest.mark.parametrize("chunking", [True, False])
def test_an_unfinished_file_gives_all_that_was_written(tmp_path, compression, chunking):
    content, _ = log_bytes(finished=False, compression=compression, chunking=chunking, extras=False)
    target = tmp_path / "new.mcap"
    recovery = rescue(content, target)
    assert not recovery.finished
    assert read(target) == expected(range(MESSAGES))


def test_complete_chunks_of_a_cut_file_are_rescued(tmp_path):
    target = tmp_path / "new.mcap"
    content, ends = log_bytes(finished=False, extras=False)
    for number, end in enumerate(ends, start=1):
        rescue(content[: end + 3], target)
        assert read(target) == expected(range(50 * number))


@settings(deadline=None)
@given(st.integers(0, len(WHOLE)))
def test_a_file_may_be_cut_anywhere(length):
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "new.mcap"
        try:
            rescue(WHOLE[:length], target)
        except SitupError:
            assert not target.exists()
            assert length < 2_500
        else:
            found = read(target)
            assert found == expected(range(len(found)))


@settings(deadline=None)
@given(st.lists(st.integers(0, 8 * len(WHOLE) - 1), min_size=1, max_size=4, unique=True))
def test_no_damage_brings_in_what_was_not_there(bits):
    content = bytearray(WHOLE)
    for bit in bits:
        content[bit // 8] ^= 1 << bit % 8
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "new.mcap"
        try:
            recovery = rescue(content, target)
        except SitupError:
            assert not target.exists()
        else:
            found = read(target)
            there = expected(sorted({sequence for _, _, sequence, _ in found}))
            # Nothing in an MCAP guards the name of a topic.
            assert [message[1:] for message in found] == [message[1:] for message in there]
            assert recovery.messages.total() == len(found)


@settings(deadline=None)
@given(st.binary(max_size=300))
def test_after_its_first_bytes_a_file_may_hold_anything(content):
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "new.mcap"
        try:
            rescue(WHOLE[:8] + content, target)
        except SitupError:
            assert not target.exists()


def test_a_damaged_chunk_is_left_out(tmp_path):
    content, ends = log_bytes(finished=False, extras=False)
    broken = bytearray(content)
    broken[ends[1] + 200] ^= 1
    recovery = rescue(broken, tmp_path / "new.mcap")
    assert recovery.damaged == 1
    lost = set(range(MESSAGES)) - {sequence for _, _, sequence, _ in read(tmp_path / "new.mcap")}
    assert lost
    assert lost < set(range(100, 150))


def test_channels_of_a_lost_first_chunk_are_taken_from_the_summary(tmp_path):
    broken = bytearray(WHOLE)
    broken[200] ^= 1
    recovery = rescue(broken, tmp_path / "new.mcap")
    assert recovery.damaged == 1
    found = read(tmp_path / "new.mcap")
    assert found == expected(range(found[0][2], MESSAGES))


def test_without_a_summary_they_are_lost(tmp_path):
    content, _ = log_bytes(finished=False)
    broken = bytearray(content)
    broken[200] ^= 1
    recovery = rescue(broken, tmp_path / "new.mcap")
    assert recovery.messages.total() == 0
    assert recovery.damaged > 200
    assert (recovery.attachments, recovery.metadata) == (1, 1)


def test_a_chunk_that_claims_a_huge_size_is_left_out(tmp_path):
    broken = bytearray(WHOLE)
    start = broken.index(b"\x06", 20)
    size = start + 9 + 16  # after opcode, length and the two times
    broken[size : size + 8] = (2**62).to_bytes(8, "little")
    assert rescue(broken, tmp_path / "new.mcap").finished


@pytest.mark.parametrize("content", [b"", b"\x89MCAP0\r", b"RIFF" * 9, b"\x89MCAP1\r\n"])
def test_what_is_no_mcap_is_refused(tmp_path, content):
    with pytest.raises(SitupError, match="this is no MCAP file"):
        rescue(content, tmp_path / "new.mcap")
    assert not (tmp_path / "new.mcap").exists()


def test_a_file_without_a_whole_chunk_is_refused(tmp_path):
    with pytest.raises(SitupError, match="nothing to rescue"):
        rescue(WHOLE[:120], tmp_path / "new.mcap")
    assert [each.name for each in tmp_path.iterdir()] == ["source.mcap.partial"]


def test_nothing_is_overwritten_unasked(tmp_path):
    source, target = tmp_path / "a.mcap", tmp_path / "b.mcap"
    source.write_bytes(WHOLE)
    target.write_bytes(b"precious")
    with pytest.raises(OutputError, match="--overwrite"):
        recover_mcap(source, target)
    assert target.read_bytes() == b"precious"
    with pytest.raises(OutputError, match="this is the file to be rescued"):
        recover_mcap(source, source, overwrite=True)
    assert source.read_bytes() == WHOLE
    recover_mcap(source, target, overwrite=True)
    assert len(read(target)) == MESSAGES


@pytest.mark.parametrize("name", ["new.mcap.partial", ".new.mcap.partial", ".new.mcap.rescue"])
@pytest.mark.parametrize("content", [WHOLE, WHOLE[:-9], WHOLE[:120]])
def test_the_source_is_never_touched(tmp_path, name, content):
    source = tmp_path / name
    source.write_bytes(content)
    with contextlib.suppress(SitupError):
        recover_mcap(source, tmp_path / "new.mcap")
        assert read(tmp_path / "new.mcap") == expected(range(MESSAGES))
    assert source.read_bytes() == content
    assert {path.name for path in tmp_path.iterdir()} <= {name, "new.mcap"}


def test_a_place_that_cannot_be_written_is_told_of(tmp_path):
    source = tmp_path / "a.mcap"
    source.write_bytes(WHOLE)
    with pytest.raises(OutputError, match="cannot write here"):
        recover_mcap(source, tmp_path / "none" / "b.mcap")


def test_a_source_that_cannot_be_read_is_not_taken_for_a_full_disk(tmp_path, monkeypatch):
    def stumble(file):
        yield from islice(file_records(file), 3)
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr("situp_annotate.formats.mcap.recovery.file_records", stumble)
    with pytest.raises(SitupError, match=r"source\.mcap\.partial: cannot be read: Input") as caught:
        rescue(WHOLE, tmp_path / "new.mcap")
    assert not isinstance(caught.value, OutputError)
    assert [each.name for each in tmp_path.iterdir()] == ["source.mcap.partial"]


def test_a_target_may_have_the_longest_of_names(tmp_path):
    target = tmp_path / f"{'x' * 250}.mcap"
    rescue(WHOLE, target)
    assert len(read(target)) == MESSAGES


KILLED = """
import os, signal, sys
from fractions import Fraction
from pathlib import Path
import numpy as np
from situp_annotate.formats.mcap.log import McapSink
from situp_annotate.types import Frame, VideoInfo

path = Path(sys.argv[1])
info = VideoInfo(path, "opencv", 64, 48, Fraction(30))
with McapSink(path, info=info, tracks=[], metadata={}, attachments={}) as sink:
    for index in range(1_000):
        sink.write(Frame(index, index, np.empty((0, 0), np.uint8)), [])
        if index == 990:
            os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
def test_a_killed_run_loses_no_more_than_250_frames(tmp_path):
    path = tmp_path / "annotations.mcap"
    command = [sys.executable, "-c", KILLED, str(path)]
    assert subprocess.run(command, check=False, timeout=120).returncode == -9
    assert [each.name for each in tmp_path.iterdir()] == ["annotations.mcap.partial"]
    recovery = recover_mcap(tmp_path / "annotations.mcap.partial", tmp_path / "new.mcap")
    assert recovery.messages["/camera/annotations"] == 750
    assert len(read(tmp_path / "new.mcap")) == recovery.messages.total()
