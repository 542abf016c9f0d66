"""labels.csv: what a run writes comes back; times and human boxes to the digit."""

import csv

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.labelled import labelled_track, labelled_video, labelled_videos

from situp_annotate.errors import SitupError
from situp_annotate.formats.csv_export import write_csv
from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.labels_csv import LabelsCsvSink, LabelsTable, read_labels_csv
from situp_annotate.types import (
    BoundingBox,
    Frame,
    Keyframe,
    Provenance,
    State,
    Track,
    TrackPoint,
)

HEADER = (
    "frame,time_s,track_id,label,state,provenance,x,y,width,height,confidence,apce,peak,scale\n"
)
IMAGE = np.zeros((0, 0), np.uint8)
BOX = BoundingBox(1, 2, 3, 4)


def track(track_id, *keyframes, label="car"):
    return Track(track_id, label, keyframes or (Keyframe(0, BOX),))


def write(path, frames, tracks):
    """Frames: time and points."""
    with LabelsCsvSink(path, tracks=tracks) as sink:
        for index, (time_ns, points) in enumerate(frames):
            sink.write(Frame(index, time_ns, IMAGE), points)
    return path


def test_rows_are_as_documented(tmp_path):
    tracked = TrackPoint(
        2, BOX, 0.75, State.LOST, Provenance.TRACKED, apce=12.3456789, peak=0.5, scale=1.25
    )
    human = TrackPoint(1, BoundingBox(0.1, 1 / 3, 30, 40), 1, State.VISIBLE, Provenance.HUMAN)
    tracks = [track(2), track(1, Keyframe(0, human.box), Keyframe(1, None), label='a "b", c')]
    path = write(tmp_path / "labels.csv", [(0, [human, tracked]), (33_366_667, [])], tracks)
    assert path.read_bytes().decode() == (
        f"{HEADER}"
        '0,0.000000000,1,"a ""b"", c",visible,human,0.1,0.3333333333333333,30,40,1,,,\n'
        "0,0.000000000,2,car,lost,tracked,1,2,3,4,0.75,12.345679,0.5,1.25\n"
        '1,0.033366667,1,"a ""b"", c",outside,human,,,,,1,,,\n'
    )


numbers = st.floats(-5000, 5000)
sizes = st.floats(0.01, 5000)
boxes = st.builds(BoundingBox, numbers, numbers, sizes, sizes)
shares = st.floats(0, 1)
signals = st.none() | st.floats(0, 1000)
labels = st.dictionaries(
    st.integers(1, 99),
    st.builds(
        TrackPoint,
        st.just(0),
        boxes,
        shares,
        st.sampled_from(State),
        st.sampled_from(Provenance),
        signals,
        signals,
        signals,
    ),
    max_size=3,
)
times = st.integers(-(10**15), 10**18)


@given(st.lists(st.tuples(times, labels), max_size=5))
def test_what_is_written_reads_back(tmp_path_factory, given_frames):
    frames = [
        (time_ns, [point_of(number, point) for number, point in sorted(points.items())])
        for time_ns, points in given_frames
    ]
    ids = sorted({point.track_id for _, points in frames for point in points})
    path = tmp_path_factory.mktemp("csv") / "labels.csv"
    table = read_labels_csv(write(path, frames, [track(number) for number in ids]))
    assert table.times_ns == {i: time_ns for i, (time_ns, points) in enumerate(frames) if points}
    assert {(f, i) for i, points in table.points.items() for f in points} == {
        (f, point.track_id) for f, (_, points) in enumerate(frames) for point in points
    }
    for frame, (_, points) in enumerate(frames):
        for point in points:
            assert_same(table.points[point.track_id][frame], point)


def point_of(track_id, point):
    names = ("box", "confidence", "state", "provenance", "apce", "peak", "scale")
    return TrackPoint(track_id, *(getattr(point, name) for name in names))


def assert_same(found, wanted):
    exact = wanted.provenance is Provenance.HUMAN
    for side in ("x", "y", "width", "height"):
        tolerance = 0 if exact else 5.1e-7
        assert abs(getattr(found.box, side) - getattr(wanted.box, side)) <= tolerance
    assert (found.state, found.provenance) == (wanted.state, wanted.provenance)
    assert found.confidence == pytest.approx(wanted.confidence, abs=5.1e-7)
    for name in ("apce", "peak", "scale"):
        value = getattr(wanted, name)
        assert getattr(found, name) == (
            value if value is None else pytest.approx(value, abs=5.1e-7)
        )


@pytest.mark.parametrize(
    "time_ns", [0, 1, -1, 999_999_999, -999_999_999, -1_000_000_000, -1_500_000_000, 10**18 + 1]
)
def test_times_are_exact_and_may_be_negative(tmp_path, time_ns):
    point = TrackPoint(1, BOX, 1, State.VISIBLE, Provenance.HUMAN)
    path = write(tmp_path / "labels.csv", [(time_ns, [point])], [track(1)])
    assert read_labels_csv(path).times_ns == {0: time_ns}


def test_a_table_without_rows_is_none_the_worse(tmp_path):
    assert read_labels_csv(write(tmp_path / "labels.csv", [], [])) == LabelsTable({}, {})


GOOD = "0,0.0,1,car,visible,human,1,2,3,4,1,,,"


@pytest.mark.parametrize(
    ("row", "what"),
    [
        (GOOD.replace("0,0.0", "x,0.0"), "'x'"),
        (GOOD.replace("0,0.0", "-1,0.0"), "frame -1"),
        (GOOD.replace("0.0", "soon"), "soon"),
        (GOOD.replace("0.0", "1.0000000001"), "no time"),
        (GOOD.replace("0.0", "1.-5"), "no time"),
        (GOOD.replace("0.0", ""), "''"),
        (GOOD.replace("visible", "seen"), "seen"),
        (GOOD.replace("human", "robot"), "robot"),
        (GOOD.replace("3,4", "0,4"), "positive width"),
        (GOOD.replace("3,4", "nan,4"), "finite"),
        (GOOD.replace("3,4", ",4"), "could not convert"),
        (GOOD.replace("4,1", "4,1.5"), "confidence 1.5"),
        (GOOD.replace("4,1", "4,nan"), "confidence nan"),
        (GOOD[:-1], "cells"),
        (f"{GOOD},", "cells"),
        (f"{GOOD}\n{GOOD}", "second label"),
        ("1" + GOOD[1:] + "\n" + GOOD, "frame 0"),
        (GOOD.replace("0,0.0", f"{2**31},0.0"), "frame 2147483648"),
        (GOOD.replace("0.0", "1" + "0" * 10), "seconds"),
        (GOOD.replace("3,4", "1e300,4"), "finite numbers of at most"),
        (GOOD.replace("3,4", "x" * 1000), "cells"),
    ],
)
def test_a_bad_row_is_named(tmp_path, row, what):
    path = tmp_path / "labels.csv"
    path.write_text(HEADER + row + "\n")
    with pytest.raises(SitupError, match=what) as caught:
        read_labels_csv(path)
    assert f"{path}: line {2 + row.count(chr(10))}: " in str(caught.value)


@pytest.mark.parametrize(
    ("content", "what"),
    [
        (b"", "first line"),
        (b"frame,id\n0,1\n", "first line"),
        (b"\xff\xfe", "this is not a labels.csv"),
        (HEADER.encode() + b'0,"0.0', "this is not a labels.csv"),
    ],
)
def test_another_file_is_refused(tmp_path, content, what):
    path = tmp_path / "labels.csv"
    path.write_bytes(content)
    with pytest.raises(SitupError, match=what):
        read_labels_csv(path)


def test_a_missing_file_is_said_to_be_missing(tmp_path):
    with pytest.raises(SitupError, match="No such file"):
        read_labels_csv(tmp_path / "labels.csv")


# ---- the export of all videos ------------------------------------------------------------------


def test_the_export_has_all_videos_in_one_table(tmp_path):
    lost = (BOX, State.LOST, Provenance.TRACKED)
    human = (BoundingBox(1 / 3, 2, 3, 4), State.VISIBLE, Provenance.HUMAN)
    one = labelled_video(
        labelled_track(2, {0: BOX, 1: lost}), labelled_track(7, {1: human}, "a,b"), video_id="one"
    )
    two = labelled_video(labelled_track(1, {3: BOX}), video_id="two")
    write_csv(iter([one, two]), tmp_path, ExportOptions())
    assert (tmp_path / "labels.csv").read_bytes().decode() == (
        f"video,{HEADER}"
        "one,0,0.000000000,2,car,visible,tracked,1,2,3,4,0.5,,,\n"
        'one,1,0.040000000,7,"a,b",visible,human,0.3333333333333333,2,3,4,0.5,,,\n'
        "two,3,0.120000000,1,car,visible,tracked,1,2,3,4,0.5,,,\n"
    )


@given(labelled_videos())
def test_the_export_has_a_row_for_each_label_that_is_wanted(tmp_path_factory, video):
    folder = tmp_path_factory.mktemp("csv")
    write_csv([video], folder, ExportOptions(states=(State.LOST, State.OCCLUDED)))
    with (folder / "labels.csv").open(newline="") as file:
        found = [(row["frame"], row["track_id"], row["state"]) for row in csv.DictReader(file)]
    wanted = {
        (str(frame), str(track.track.id), point.state)
        for track in video.tracks
        for frame, point in track.points.items()
        if point.state is not State.VISIBLE
    }
    assert set(found) == wanted
    assert len(found) == len(wanted)
    assert found == sorted(found, key=lambda row: (int(row[0]), int(row[1])))


def test_a_message_says_no_more_than_a_person_reads(tmp_path):
    path = tmp_path / "labels.csv"
    path.write_text(HEADER + GOOD.replace("visible", "x" * 100_000) + "\n")
    with pytest.raises(SitupError, match="xxx") as caught:
        read_labels_csv(path)
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("provenance", Provenance)
def test_a_box_never_shrinks_to_nothing(tmp_path, provenance):
    thin = BoundingBox(1, 2, 1e-9, 4)
    point = TrackPoint(1, thin, 1, State.VISIBLE, provenance)
    table = read_labels_csv(write(tmp_path / "labels.csv", [(0, [point])], [track(1)]))
    kept = 1e-9 if provenance is Provenance.HUMAN else 1e-6
    assert table.points[1][0].box.width == kept
