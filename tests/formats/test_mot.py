"""MOT CSV: exact rows, and read back."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from situp_annotate.errors import SitupError
from situp_annotate.formats.mot.rows import NO_TRACK, MotSink, parse_mot, read_mot
from situp_annotate.types import BoundingBox, Frame, Provenance, State, TrackPoint

IMAGE = np.zeros((2, 2), np.uint8)


def point(track_id, box, confidence=1.0):
    return TrackPoint(track_id, box, confidence, State.VISIBLE, Provenance.TRACKED)


def write(path, frames, **options):
    with MotSink(path, **options) as sink:
        for index, points in enumerate(frames):
            sink.write(Frame(index, index * 40_000_000, IMAGE), points)
    return path


def test_rows_are_as_motchallenge_wants_them(tmp_path):
    frames = [
        [point(1, BoundingBox(0, 10.5, 20, 30)), point(7, BoundingBox(-3.25, 4, 5, 6), 0.5)],
        [],
        [point(1, BoundingBox(-0.0001, 1 / 3, 20, 30), 0.98765)],
    ]
    path = write(tmp_path / "mot.csv", frames)
    assert path.read_bytes() == (
        b"1,1,0,10.5,20,30,1,-1,-1,-1\n"
        b"1,7,-3.25,4,5,6,0.5,-1,-1,-1\n"
        b"3,1,0,0.333,20,30,0.988,-1,-1,-1\n"
    )


def test_pixels_may_count_from_one(tmp_path):
    frames = [[point(1, BoundingBox(0, 9, 20, 30))]]
    path = write(tmp_path / "mot.csv", frames, pixel_origin=1)
    assert path.read_text().startswith("1,1,1,10,20,30,")
    assert read_mot(path, pixel_origin=1)[0].box == BoundingBox(0, 9, 20, 30)


def test_only_boxes_in_the_wanted_states_get_rows(tmp_path):
    box = BoundingBox(0, 10, 20, 30)
    points = [
        TrackPoint(number, box, 0.5, state, Provenance.TRACKED)
        for number, state in enumerate(State, start=1)
    ]
    states = (State.VISIBLE, State.LOST)
    rows = read_mot(write(tmp_path / "mot.csv", [points], states=states))
    assert [row.track_id for row in rows] == [points[0].track_id, points[2].track_id]
    assert len(read_mot(write(tmp_path / "all.csv", [points]))) == len(State)


numbers = st.floats(-5000, 5000)
sizes = st.floats(0.01, 5000)
boxes = st.builds(BoundingBox, numbers, numbers, sizes, sizes)
tracks = st.dictionaries(st.integers(1, 9999), st.tuples(boxes, st.floats(0, 1)), max_size=4)


@given(st.lists(tracks, max_size=5))
def test_what_is_written_reads_back(tmp_path_factory, frames):
    path = tmp_path_factory.mktemp("mot") / "mot.csv"
    write(path, [[point(i, *frame[i]) for i in sorted(frame)] for frame in frames])
    rows = read_mot(path)
    expected = [(index, i, *frame[i]) for index, frame in enumerate(frames) for i in sorted(frame)]
    assert [(row.frame, row.track_id) for row in rows] == [row[:2] for row in expected]
    for row, (_, _, box, confidence) in zip(rows, expected, strict=True):
        written = (row.box.x, row.box.y, row.box.width, row.box.height, row.confidence)
        assert written == pytest.approx((box.x, box.y, box.width, box.height, confidence), abs=6e-4)


@pytest.mark.parametrize(
    "line",
    ["0,1,2,3,4,5,1", "1,1,2,3,4", "a,1,2,3,4,5,1", "1,1,2,3,0,5,1", "1,1,nan,3,4,5,1",
     "1,1,2,3,4,5,nan", "1,1,9,9,9,9,1", "1.5,1,2,3,4,5,1", "1e400,1,2,3,4,5,1",
     "2147483648,1,2,3,4,5,1", "1,-2,2,3,4,5,1", "1,1,2,3,4,5,1,x,1", "1,1,2,3,4,5,1,1,inf"],
)  # fmt: skip
def test_bad_rows_are_named(tmp_path, line):
    path = tmp_path / "mot.csv"
    path.write_text(f"1,1,2,3,4,5,1\n\n{line}\n")
    with pytest.raises(SitupError, match=r"mot\.csv: line 3"):
        read_mot(path)


def test_files_that_cannot_be_read_are_named(tmp_path):
    with pytest.raises(SitupError, match=r"none\.csv: cannot be read"):
        read_mot(tmp_path / "none.csv")
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe")
    with pytest.raises(SitupError, match=r"bytes\.csv: cannot be read"):
        read_mot(tmp_path / "bytes.csv")


@pytest.mark.parametrize(
    ("line", "class_number", "visibility"),
    [
        ("1,1,2,3,4,5,1,2,0.5", 2, 0.5),
        ("1,1,2,3,4,5,1,-1,-1", -1, -1),
        ("1,1,2,3,4,5,1", None, None),
        ("1,1,2,3,4,5,1,7,8,9", None, None),
        ("1.0, 1 ,2,3,4,5,1,2.0,1\r", 2, 1),
    ],
)
def test_nine_columns_are_ground_truth(line, class_number, visibility):
    (row,) = parse_mot(line, "text")
    assert (row.frame, row.track_id) == (0, 1)
    assert (row.class_number, row.visibility) == (class_number, visibility)


def test_boxes_of_no_track_may_share_a_frame():
    rows = parse_mot("1,-1,2,3,4,5,1\n1,-1,2,3,4,5,1\n", "text")
    assert [row.track_id for row in rows] == [NO_TRACK, NO_TRACK]
