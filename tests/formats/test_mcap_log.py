"""The MCAP read back with the mcap package."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from situp_annotate.formats.appearance import track_color
from situp_annotate.formats.mcap.log import LOG_TOPIC, TRACKS_TOPIC, McapSink
from situp_annotate.types import (
    BoundingBox,
    Finding,
    Frame,
    Keyframe,
    Provenance,
    State,
    Track,
    TrackPoint,
    VideoInfo,
)

INFO = VideoInfo(Path("street.mp4"), "opencv", 640, 360, Fraction(30))
BOX = BoundingBox(10.5, 20, 30, 40)
TRACKS = [Track(3, "Fußgänger", (Keyframe(0, BOX),)), Track(5, "car", (Keyframe(0, BOX),))]
TIMES = [0, 33_366_667, 1_000_000_001, 90 * 3600 * 1_000_000_000]
HUMAN = TrackPoint(3, BOX, 1.0, State.VISIBLE, Provenance.HUMAN)
TRACKED = TrackPoint(
    5, BoundingBox(-4, 5, 6, 7), 0.25, State.OCCLUDED, Provenance.TRACKED, 41.5, 0.375, 1.25
)
POINTS = [[HUMAN], [HUMAN, TRACKED], [], [TRACKED]]


@pytest.fixture
def log(tmp_path):
    csv = tmp_path / "mot.csv"
    sink = McapSink(
        tmp_path / "annotations.mcap",
        info=INFO,
        tracks=TRACKS,
        metadata={"version": "1.2.3"},
        attachments={"manifest.json": b"{}", "mot.csv": csv},
    )
    with sink:
        for index, (time, points) in enumerate(zip(TIMES, POINTS, strict=True)):
            findings = (Finding("gap", "Two frames are missing.", 2),) if index == 2 else ()
            sink.write(Frame(index, time, np.zeros((2, 2), np.uint8), findings), points)
        csv.write_text("complete only now\n")
    return tmp_path / "annotations.mcap"


def decoded(path, topic):
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return [
            (message.log_time, message.publish_time, proto)
            for _, _, message, proto in reader.iter_decoded_messages(topics=[topic])
        ]


def nanoseconds(timestamp):
    return timestamp.seconds * 1_000_000_000 + timestamp.nanos


def test_summary_tells_channels_schemas_counts_and_compression(log):
    with log.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    schemas = {schema.id: (schema.name, schema.encoding) for schema in summary.schemas.values()}
    found = {
        channel.topic: (
            *schemas[channel.schema_id],
            channel.message_encoding,
            summary.statistics.channel_message_counts[channel.id],
        )
        for channel in summary.channels.values()
    }
    assert found == {
        "/camera/annotations": ("foxglove.ImageAnnotations", "protobuf", "protobuf", 4),
        "/camera/tracks": ("situp_annotate.TrackStates", "protobuf", "protobuf", 4),
        "/camera/log": ("foxglove.Log", "protobuf", "protobuf", 3),
    }
    assert {chunk.compression for chunk in summary.chunk_indexes} == {"zstd"}
    assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (
        TIMES[0],
        TIMES[-1],
    )


@pytest.mark.parametrize("topic", ["/camera/annotations", TRACKS_TOPIC])
def test_every_frame_has_a_message_at_its_own_time(log, topic):
    messages = decoded(log, topic)
    assert [log_time for log_time, _, _ in messages] == TIMES
    assert [publish_time for _, publish_time, _ in messages] == TIMES
    assert [nanoseconds(proto.timestamp) for _, _, proto in messages] == TIMES


def test_boxes_are_closed_lines_with_text(log):
    protos = [proto for _, _, proto in decoded(log, "/camera/annotations")]
    assert [len(proto.points) for proto in protos] == [1, 2, 0, 1]
    (shape,), (text,) = protos[0].points, protos[0].texts
    assert shape.type == shape.LINE_LOOP
    corners = [(corner.x, corner.y) for corner in shape.points]
    assert corners == [(10.5, 20), (40.5, 20), (40.5, 60), (10.5, 60)]
    color = (shape.outline_color.r, shape.outline_color.g, shape.outline_color.b)
    assert tuple(round(255 * level) for level in color) == track_color(3)
    assert text.text == "#3 Fußgänger key"
    assert protos[3].texts[0].text == "#5 car 0.25 occluded"


def test_states_carry_everything(log):
    protos = [proto for _, _, proto in decoded(log, TRACKS_TOPIC)]
    assert [proto.frame for proto in protos] == [0, 1, 2, 3]
    assert [[state.id for state in proto.states] for proto in protos] == [[3], [3, 5], [], [5]]
    human, tracked = protos[1].states
    assert (human.label, human.provenance, human.HasField("apce")) == ("Fußgänger", "human", False)
    assert (tracked.x, tracked.y, tracked.width, tracked.height) == (-4, 5, 6, 7)
    assert (tracked.confidence, tracked.state) == (0.25, "occluded")
    assert (tracked.apce, tracked.peak, tracked.scale) == (41.5, 0.375, 1.25)


def test_lost_boxes_are_faint(tmp_path):
    lost = TrackPoint(5, BOX, 0.1, State.LOST, Provenance.INTERPOLATED)
    path = tmp_path / "annotations.mcap"
    with McapSink(path, info=INFO, tracks=TRACKS, metadata={}, attachments={}) as sink:
        sink.write(Frame(0, 0, np.empty((0, 0), np.uint8)), [HUMAN, lost])
    ((_, _, proto),) = decoded(path, "/camera/annotations")
    assert [shape.outline_color.a for shape in proto.points] == [1.0, pytest.approx(0.4)]
    assert [text.text for text in proto.texts] == ["#3 Fußgänger key", "#5 car 0.10 lost"]
    ((_, _, proto),) = decoded(path, TRACKS_TOPIC)
    assert [state.state for state in proto.states] == ["visible", "lost"]
    assert (proto.states[1].provenance, proto.states[1].x) == ("interpolated", 10.5)


def test_tracks_are_outside_from_the_keyframe_that_says_so_to_the_next_box(tmp_path):
    keyframes = (Keyframe(0, BOX), Keyframe(1, None), Keyframe(3, BOX), Keyframe(4, None))
    tracks = [Track(3, "car", keyframes), TRACKS[1]]
    path = tmp_path / "annotations.mcap"
    with McapSink(path, info=INFO, tracks=tracks, metadata={}, attachments={}) as sink:
        for index in range(6):
            points = [HUMAN] if index in (0, 3) else []
            sink.write(Frame(index, index, np.empty((0, 0), np.uint8)), points)
    protos = [proto for _, _, proto in decoded(path, TRACKS_TOPIC)]
    states = [[(state.id, state.state) for state in proto.states] for proto in protos]
    seen, outside = [(3, "visible")], [(3, "outside")]
    assert states == [seen, outside, outside, seen, outside, outside]
    (state,) = protos[1].states
    assert not any(state.HasField(name) for name in ("x", "y", "width", "height", "apce"))
    assert (state.label, state.provenance, state.confidence) == ("car", "human", 1.0)
    assert all(protos[0].states[0].HasField(name) for name in ("x", "y", "width", "height"))
    assert not any(proto.points for _, _, proto in decoded(path, "/camera/annotations")[1:3])


def test_the_schema_is_as_documented(log):
    """The text in the module is what the log's schema says."""
    from situp_annotate.formats.mcap import track_states

    kinds = {1: "double", 4: "uint64", 9: "string", 13: "uint32"}
    descriptor = track_states.TrackStates.DESCRIPTOR.fields_by_name["states"].message_type
    for field in descriptor.fields:
        optional = "optional " if field.has_presence else ""
        line = f"{optional}{kinds[field.type]} {field.name} = {field.number};"
        assert line in track_states.__doc__


def test_findings_stand_in_the_log_at_their_frame(log):
    messages = decoded(log, LOG_TOPIC)
    assert [log_time for log_time, _, _ in messages] == [TIMES[0], TIMES[2], TIMES[-1]]
    assert [proto.level for _, _, proto in messages] == [2, 3, 2]
    assert messages[1][2].message == "Two frames are missing."


def test_metadata_and_attachments(log):
    with log.open("rb") as stream:
        reader = make_reader(stream)
        (record,) = list(reader.iter_metadata())
        attachments = {
            each.name: (each.media_type, each.data) for each in reader.iter_attachments()
        }
    assert record.name == "situp-annotate"
    assert record.metadata == {"version": "1.2.3", "frame_count": "4", "pictures": "none"}
    assert attachments == {
        "manifest.json": ("application/json", b"{}"),
        "mot.csv": ("text/csv", b"complete only now\n"),
    }


def test_a_failure_leaves_no_log(tmp_path):
    path = tmp_path / "annotations.mcap"
    with (
        pytest.raises(ZeroDivisionError),
        McapSink(path, info=INFO, tracks=TRACKS, metadata={}, attachments={}) as sink,
    ):
        sink.write(Frame(0, 0, np.zeros((2, 2), np.uint8)), [])
        assert [each.name for each in tmp_path.iterdir()] == ["annotations.mcap.partial"]
        raise ZeroDivisionError
    assert not [*tmp_path.iterdir()]


def test_a_log_that_cannot_be_finished_is_not_there(tmp_path):
    missing = {"mot.csv": tmp_path / "mot.csv"}
    path = tmp_path / "annotations.mcap"
    sink = McapSink(path, info=INFO, tracks=TRACKS, metadata={}, attachments=missing)
    with pytest.raises(FileNotFoundError), sink:
        sink.write(Frame(0, 0, np.zeros((2, 2), np.uint8)), [])
    assert not [*tmp_path.iterdir()]
