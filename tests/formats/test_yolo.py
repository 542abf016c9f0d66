"""YOLO: labels that Ultralytics trains with, in step with the pictures."""

import json
from dataclasses import replace

import cv2
import pytest
from hypothesis import given, settings
from support.labelled import SIZE, labelled_track, labelled_video, labelled_videos
from support.media import read_index, write_video

from situp_annotate.errors import VideoError
from situp_annotate.formats.clipping import clipped
from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.yolo import write_yolo
from situp_annotate.types import BoundingBox, Provenance, State
from situp_annotate.video import open_video

BOX = BoundingBox(64, 48, 32, 24)
LOST = (BOX, State.LOST, Provenance.TRACKED)


def write(folder, *videos, **options):
    write_yolo(iter(videos), folder, ExportOptions(**options))
    return folder


def texts(folder):
    return {path.name: path.read_text() for path in sorted(folder.iterdir())}


def test_files_are_as_ultralytics_wants_them(tmp_path):
    video = labelled_video(
        labelled_track(3, {0: BOX, 2: BoundingBox(-32, 456, 64, 48)}),
        labelled_track(7, {0: BoundingBox(0, 0, 640, 480)}, "dog"),
        frame_count=4,
    )
    write(tmp_path, video)
    assert texts(tmp_path / "labels" / "clip") == {
        "000000.txt": "0 0.125000 0.125000 0.050000 0.050000\n"
        "1 0.500000 0.500000 1.000000 1.000000\n",
        "000001.txt": "",
        "000002.txt": "0 0.025000 0.975000 0.050000 0.050000\n",
        "000003.txt": "",
    }
    assert texts(tmp_path / "tracks" / "clip") == {
        "000000.txt": "0 0.125000 0.125000 0.050000 0.050000 3\n"
        "1 0.500000 0.500000 1.000000 1.000000 7\n",
        "000001.txt": "",
        "000002.txt": "0 0.025000 0.975000 0.050000 0.050000 3\n",
        "000003.txt": "",
    }
    assert sorted(path.name for path in tmp_path.iterdir()) == ["data.yaml", "labels", "tracks"]


def test_the_configuration_names_videos_and_classes(tmp_path):
    one = labelled_video(labelled_track(1, {0: BOX}, 'a: "b"'), video_id="one")
    two = labelled_video(labelled_track(1, {0: BOX}), labelled_track(2, {}, 'a: "b"'), video_id="2")
    lines = (write(tmp_path, one, two) / "data.yaml").read_text().splitlines()
    assert [line for line in lines if not line.startswith("#")] == [
        "train:",
        '  - "images/one"',
        '  - "images/2"',
        "val:",
        '  - "images/one"',
        '  - "images/2"',
        "names:",
        '  0: "a: \\"b\\""',
        '  1: "car"',
    ]
    assert next(iter(texts(tmp_path / "labels" / "2"))) == "000001.txt"


def test_boxes_out_of_the_picture_or_too_thin_to_write_are_left_out(tmp_path):
    points = {0: BoundingBox(640, 0, 9, 9), 1: BoundingBox(639.9999, 0, 9, 9)}
    write(tmp_path, labelled_video(labelled_track(1, points), frame_count=2))
    assert texts(tmp_path / "labels" / "clip") == {"000000.txt": "", "000001.txt": ""}


def test_frames_before_a_track_are_no_examples_of_background(tmp_path):
    """Nobody has said that the object is not there yet."""
    one = labelled_video(
        labelled_track(1, {2: BOX}), labelled_track(2, dict.fromkeys(range(6), BOX)), frame_count=6
    )
    write(tmp_path, one)
    assert list(texts(tmp_path / "labels" / "clip")) == [f"00000{n}.txt" for n in (2, 3, 4, 5)]


def test_a_frame_with_a_hidden_object_that_is_left_out_is_none_either(tmp_path):
    hidden = (BOX, State.OCCLUDED, Provenance.TRACKED)
    video = labelled_video(labelled_track(1, {0: BOX, 1: hidden}), frame_count=3)
    write(tmp_path, video, states=(State.VISIBLE,))
    assert list(texts(tmp_path / "labels" / "clip")) == ["000000.txt", "000002.txt"]


def test_a_frame_with_a_lost_object_is_no_example_of_background(tmp_path):
    video = labelled_video(
        labelled_track(1, {0: BOX, 1: LOST}), labelled_track(2, {0: BOX, 1: BOX}), frame_count=3
    )
    (tmp_path / "without").mkdir()
    (tmp_path / "with").mkdir()
    write(tmp_path / "without", video)
    write(tmp_path / "with", video, states=tuple(State))
    assert list(texts(tmp_path / "without" / "labels" / "clip")) == ["000000.txt", "000002.txt"]
    everything = texts(tmp_path / "with" / "tracks" / "clip")
    assert everything["000001.txt"].split()[5::6] == ["1", "2"]


@settings(deadline=None)
@given(labelled_videos(frame_count=8))
def test_every_line_is_a_clipped_box_within_the_picture(tmp_path_factory, video):
    folder = write(tmp_path_factory.mktemp("yolo"), video)
    names = [json.loads(line.split(": ", 1)[1]) for line in yaml_names(folder)]
    found = {}
    for path in (folder / "tracks" / video.id).iterdir():
        lines = path.read_text().splitlines()
        label_lines = (folder / "labels" / video.id / path.name).read_text().splitlines()
        assert [line.rsplit(" ", 1)[0] for line in lines] == label_lines
        for line in lines:
            number, *shares, track_id = line.split()
            assert all(0 <= float(share) <= 1 for share in shares)
            found[int(path.stem), int(track_id)] = (names[int(number)], *map(float, shares))
    wanted = {
        (frame, track.track.id): (track.track.label, clipped(point.box, *SIZE))
        for track in video.tracks
        for frame, point in track.in_states(ExportOptions().states).items()
    }
    unsettled = {f for track in video.tracks for f in track.in_states((State.LOST,))}
    for track in video.tracks:
        unsettled.update(range(next(iter(track.points), 1)))
    for key, (label, box) in wanted.items():
        if key[0] in unsettled or box is None or box.width < 0.01 or box.height < 0.01:
            continue
        found_label, x, y, width, height = found[key]
        assert found_label == label
        assert (x * 640, y * 480) == pytest.approx(
            (box.x + box.width / 2, box.y + box.height / 2), abs=1e-3
        )
        assert (width * 640, height * 480) == pytest.approx((box.width, box.height), abs=1e-3)
    assert found.keys() <= wanted.keys()
    assert not {frame for frame, _ in found} & unsettled


def yaml_names(folder):
    lines = (folder / "data.yaml").read_text().splitlines()
    return lines[lines.index("names:") + 1 :]


# ---- pictures ------------------------------------------------------------------------------


def of_file(path, *tracks, frame_count):
    with open_video(path) as source:
        info = source.info
    return replace(labelled_video(*tracks, frame_count=frame_count), info=info)


def test_pictures_are_in_step_with_labels(tmp_path):
    path = write_video(tmp_path / "clip.mp4", count=12, rotation_degrees=90, b_frames=2)
    points = {3: BoundingBox(1, 1, 5, 5), 5: LOST}
    video = of_file(path, labelled_track(1, points), frame_count=12)
    (tmp_path / "yolo").mkdir()
    folder = write(tmp_path / "yolo", video, images=True)
    pictures = sorted((folder / "images" / "clip").iterdir())
    assert [picture.stem for picture in pictures] == [
        label.stem for label in sorted((folder / "labels" / "clip").iterdir())
    ]
    assert [read_index(cv2.imread(str(picture))) for picture in pictures] == [
        index for index in range(3, 12) if index != 5
    ]


def test_a_video_that_is_another_one_now_is_refused(tmp_path):
    path = write_video(tmp_path / "clip.mp4", count=12)
    video = of_file(path, labelled_track(1, {3: BOX}), frame_count=11)
    (tmp_path / "yolo").mkdir()
    with pytest.raises(VideoError, match="has 12 frames now, but had 11"):
        write(tmp_path / "yolo", video, images=True)
