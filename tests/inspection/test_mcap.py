"""MCAP logs: whole, cut off at every kind of place, damaged, of other tools."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, IndexType, Writer

from situp_annotate.inspection import Grade, inspect_path


def write_log(path, *, pictures=8, boxes=8, finish=True, chunk_size=200, **options):
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=chunk_size, compression=CompressionType.ZSTD, **options)
        writer.start(library="test")
        channels = {}
        for topic, name, number in (
            ("/camera/video", "foxglove.CompressedVideo", pictures),
            ("/camera/annotations", "foxglove.ImageAnnotations", boxes),
        ):
            if number is not None:
                schema = writer.register_schema(name, "protobuf", b"")
                channels[writer.register_channel(topic, "protobuf", schema)] = number
        for index in range(max(channels.values(), default=0)):
            for channel, number in channels.items():
                if index < number:
                    time = index * 1_000_000_000
                    writer.add_message(channel, time, b"x" * 30, time)
        writer.add_metadata("situp-annotate", {"version": "1", "frame_count": str(boxes)})
        writer.add_attachment(0, 0, "mot.csv", "text/csv", b"1,1")
        if finish:
            writer.finish()
        else:
            file.flush()
    return path


def kinds(report):
    return {remark.kind for remark in report.remarks}


@pytest.mark.parametrize("quick", [False, True])
def test_a_whole_log(tmp_path, quick):
    report = inspect_path(write_log(tmp_path / "a.mcap"), quick=quick)
    assert (report.kind, report.title) == ("mcap", "MCAP log, 2 channels, 16 messages")
    assert report.remarks == ()
    facts = dict(report.facts)
    assert facts["time"] == "0.000 s to 7.000 s, 7.000 s long"
    assert facts["/camera/video"] == "8 messages of foxglove.CompressedVideo, protobuf"
    assert facts["attachments"] == "mot.csv"
    assert facts["metadata situp-annotate"] == "frame_count 8, version 1"
    chunks, indexed = facts["chunks"].removesuffix(" indexed").split(", ")
    assert chunks == indexed != "1"


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize(
    ("options", "kind", "grade"),
    [
        ({"finish": False}, "unfinished", Grade.PROBLEM),
        ({"pictures": None}, "no_picture", Grade.NOTE),
        ({"boxes": 5}, "pictures_differ", Grade.WARNING),
        ({"pictures": 0, "boxes": 0}, "empty", Grade.WARNING),
        ({"index_types": IndexType.NONE}, "index", Grade.WARNING),
    ],
)
def test_what_bites(tmp_path, options, kind, grade, quick):
    report = inspect_path(write_log(tmp_path / "a.mcap", **options), quick=quick)
    assert kinds(report) == {kind}
    assert report.grade is grade


def test_an_unfinished_log_says_what_can_be_saved(tmp_path):
    path = write_log(tmp_path / "a.mcap", finish=False)
    message = inspect_path(path).remarks[0].message
    assert f"`situp-annotate recover {path}`" in message
    assert "whole" in message


def test_damage_in_the_middle(tmp_path):
    path = write_log(tmp_path / "a.mcap")
    content = bytearray(path.read_bytes())
    content[content.index(b"\x28\xb5\x2f\xfd") + 12] ^= 0xFF
    path.write_bytes(content)
    report = inspect_path(path)
    assert "damaged" in kinds(report)
    assert "1 record in it cannot be read" in report.remarks[0].message


@given(place=st.floats(0, 1), value=st.integers(0, 255))
@settings(max_examples=60, deadline=None)
def test_no_damage_makes_it_fail(tmp_path_factory, place, value):
    path = tmp_path_factory.mktemp("damaged") / "a.mcap"
    write_log(path)
    content = bytearray(path.read_bytes())
    content[int(place * (len(content) - 1))] = value
    path.write_bytes(content)
    assert inspect_path(path).title
    assert inspect_path(path, quick=True).title


@given(share=st.floats(0, 1))
@settings(max_examples=40, deadline=None)
def test_a_log_that_was_cut_off(tmp_path_factory, share):
    path = tmp_path_factory.mktemp("cut") / "a.mcap"
    content = write_log(path).read_bytes()
    path.write_bytes(content[: int(share * (len(content) - 1))])
    for quick in (False, True):
        assert inspect_path(path, quick=quick).grade is Grade.PROBLEM
