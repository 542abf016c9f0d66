"""The picture channel, read back: one picture a frame, at the frame's time, and the right one."""

import itertools
import json
from fractions import Fraction

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from support.media import (
    draw_index,
    read_index,
    write_cut,
    write_image_folder,
    write_video,
)
from support.pictures import decode_each

from situp_annotate.errors import VideoError
from situp_annotate.formats.mcap.layout import layout_json
from situp_annotate.formats.mcap.log import ANNOTATIONS_TOPIC, McapSink
from situp_annotate.formats.mcap.pictures import McapOptions, open_pictures
from situp_annotate.video import open_video

VFR_PTS = list(itertools.accumulate([2, 3, 7, 4] * 11, initial=0))
HEVC = {"x265-params": "log-level=none:keyint=15:pools=none"}
VIDEOS = {
    "plain.mp4": (lambda path: write_video(path), "h264, as in the source"),
    "hevc.mp4": (
        lambda path: write_video(path, codec="libx265", options=HEVC),
        "h265, as in the source",
    ),
    "variable.mp4": (
        lambda path: write_video(path, count=45, pts=VFR_PTS, time_base=Fraction(1, 90)),
        "h264, as in the source",
    ),
    "b_frames.mp4": (
        lambda path: write_video(path, b_frames=2),
        "h264, encoded anew: the source has B-frames, or says that it may have",
    ),
    "variable_b.mp4": (
        lambda path: write_video(
            path, count=45, pts=VFR_PTS, time_base=Fraction(1, 90), b_frames=2
        ),
        "h264, encoded anew: the source has B-frames, or says that it may have",
    ),
    "turned.mp4": (
        lambda path: write_video(path, rotation_degrees=90),
        "h264, encoded anew: the source is rotated",
    ),
    "cut.mp4": (
        lambda path: write_cut(write_video(path.with_suffix(".mkv")), path, 0.7),
        "h264, encoded anew: coded picture 0 of the source does not give frame 0",
    ),
    "vp9.webm": (
        lambda path: write_video(path, codec="libvpx-vp9"),
        "h264, encoded anew: the source is vp9",
    ),
    "mpeg4.avi": (lambda path: write_video(path), "h264, encoded anew: the source is mpeg4"),
    "odd.mp4": (
        lambda path: write_video(path, codec="mpeg4", size_hw=(47, 63)),
        "h264, encoded anew: the source is mpeg4",
    ),
    "images": (write_image_folder, "h264, encoded anew: the source is images"),
}


def read_frames(path):
    with open_video(path) as source:
        return source.info, list(source)


def write_log(path, source, options):
    """Write a log of a video without tracks, giving it no more pictures than it asks for."""
    info, frames = read_frames(source)
    pictures = open_pictures(info, [frame.pts_ns for frame in frames], options)
    sink = McapSink(path, info=info, tracks=[], metadata={}, attachments={}, pictures=pictures)
    with sink:
        for frame in frames:
            image = frame.image if sink.wants_pictures else np.empty((0, 0), np.uint8)
            sink.write(type(frame)(frame.index, frame.pts_ns, image), [])
    return info, frames


def messages(path, topic):
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return [(message, proto) for _, _, message, proto in reader.iter_decoded_messages(topic)]


def metadata(path):
    with path.open("rb") as file:
        (record,) = make_reader(file).iter_metadata()
        return record.metadata


@pytest.mark.parametrize("name", VIDEOS)
def test_each_frame_has_its_picture_at_its_time(tmp_path, name):
    write, origin = VIDEOS[name]
    path = tmp_path / "annotations.mcap"
    _, frames = write_log(path, write(tmp_path / name), McapOptions())
    assert metadata(path)["pictures"] == origin

    found = messages(path, "/camera/video")
    times = [frame.pts_ns for frame in frames]
    assert [message.log_time for message, _ in found] == times
    assert [message.publish_time for message, _ in found] == times
    assert [message.sequence for message, _ in found] == [*range(len(frames))]
    for topic in ("/camera/video", ANNOTATIONS_TOPIC):
        stamps = [proto.timestamp for _, proto in messages(path, topic)]
        assert [stamp.seconds * 10**9 + stamp.nanos for stamp in stamps] == times

    (video_format,) = {proto.format for _, proto in found}
    codec = {"h264": "h264", "h265": "hevc"}[video_format]
    images = decode_each([proto.data for _, proto in found], codec)
    if "as in" in origin:
        assert all(map(np.array_equal, images, [frame.image for frame in frames]))
    height, width = frames[0].image.shape[:2]
    numbers = [read_index(image[:height, :width]) for image in images]
    assert numbers == [read_index(frame.image) for frame in frames]


@pytest.mark.parametrize("name", ["plain.mp4", "b_frames.mp4"])
def test_indexes_and_statistics(tmp_path, name):
    path = tmp_path / "annotations.mcap"
    write_log(path, VIDEOS[name][0](tmp_path / name), McapOptions())
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    (channel,) = [each for each in summary.channels.values() if each.topic == "/camera/video"]
    schema = summary.schemas[channel.schema_id]
    assert (schema.name, schema.encoding) == ("foxglove.CompressedVideo", "protobuf")
    assert summary.statistics.channel_message_counts[channel.id] == 60
    assert summary.statistics.message_count == 60 * 3 + 2
    indexed = sum(len(index.message_index_offsets) for index in summary.chunk_indexes)
    assert indexed == 4
    second = 1_000_000_000
    with path.open("rb") as file:
        reader = make_reader(file)
        later = [
            *reader.iter_messages("/camera/video", starting_at=second, ending_before=2 * second)
        ]
    assert len(later) == 30


def test_jpegs_by_recipe(tmp_path):
    path = tmp_path / "annotations.mcap"
    source = write_video(tmp_path / "plain.mp4")
    _, frames = write_log(path, source, McapOptions(pictures="jpeg", jpeg_quality=90))
    found = messages(path, "/camera/image")
    assert [message.log_time for message, _ in found] == [frame.pts_ns for frame in frames]
    assert {(proto.format, proto.frame_id) for _, proto in found} == {("jpeg", "camera")}
    images = [
        cv2.imdecode(np.frombuffer(proto.data, np.uint8), cv2.IMREAD_COLOR) for _, proto in found
    ]
    assert [read_index(image) for image in images] == [*range(60)]
    assert metadata(path)["pictures"] == "jpeg, quality 90"


def test_no_pictures_by_recipe(tmp_path):
    path = tmp_path / "annotations.mcap"
    write_log(path, write_video(tmp_path / "plain.mp4"), McapOptions(pictures="none"))
    with path.open("rb") as file:
        topics = {each.topic for each in make_reader(file).get_summary().channels.values()}
    assert topics == {"/camera/annotations", "/camera/tracks", "/camera/log"}


def test_h265_is_encoded_anew_where_h264_is_asked_for(tmp_path):
    path = tmp_path / "annotations.mcap"
    source = VIDEOS["hevc.mp4"][0](tmp_path / "hevc.mp4")
    write_log(path, source, McapOptions(pictures="h264"))
    assert {proto.format for _, proto in messages(path, "/camera/video")} == {"h264"}
    assert metadata(path)["pictures"] == "h264, encoded anew: the source is hevc"


def test_a_video_that_was_changed_meanwhile_is_told_of(tmp_path):
    source = write_video(tmp_path / "plain.mp4")
    info, frames = read_frames(source)
    pictures = open_pictures(info, [frame.pts_ns for frame in frames], McapOptions())
    write_video(source, count=20)
    with pytest.raises(VideoError, match="gave no picture for frame 20"):
        for frame in frames:
            pictures.message(frame)


def test_a_picture_s_bytes_are_the_stream_s(tmp_path):
    noise = np.random.default_rng(5)
    pictures = [
        noise.integers(0, 60, (240, 320, 3), np.uint8) + draw_index(k, (240, 320)) // 2
        for k in range(60)
    ]
    source = write_video(tmp_path / "noise.mp4", pictures, gop=30)
    path = tmp_path / "annotations.mcap"
    write_log(path, source, McapOptions())
    size = sum(len(message.data) for message, _ in messages(path, "/camera/video"))
    assert abs(size / source.stat().st_size - 1) < 0.02
    assert abs(path.stat().st_size / source.stat().st_size - 1) < 0.05


def test_the_layout_shows_the_boxes_over_the_picture():
    layout = json.loads(layout_json("/camera/video", ANNOTATIONS_TOPIC))
    panel = layout["configById"][layout["layout"]]
    assert panel["imageMode"]["imageTopic"] == "/camera/video"
    assert panel["imageMode"]["annotations"] == {"/camera/annotations": {"visible": True}}
    assert layout["layout"].startswith("Image!")
