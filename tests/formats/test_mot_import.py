"""MOTChallenge, its detections, and CVAT's archive: rows to keyframes."""

import zipfile

import pytest
from hypothesis import given
from support.labelled import import_hints, labelled_video, labelled_videos

from situp_annotate.errors import SitupError
from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.mot.exporting import write_cvat_mot, write_mot, write_mot_truth
from situp_annotate.formats.mot.importing import read_mot_seeds, recognizes_mot
from situp_annotate.types import BoundingBox, Keyframe, State

BOX = BoundingBox(2, 3, 4, 5)
OPTIONS = ExportOptions()


def rows(folder, *lines, name="clip.txt"):
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines))
    return path


def read(path, hints=None):
    (seeds,) = read_mot_seeds(path, hints or import_hints())
    return seeds


# ---- round trips -------------------------------------------------------------------------------


def where_labels_are(labelled, frame_count):
    """Frames with a box and the first of each stretch without, as an import has to give them."""
    points = labelled.in_states(OPTIONS.states)
    gone = {frame + 1 for frame in points if frame + 1 not in points and frame + 1 < frame_count}
    return {frame: points.get(frame) for frame in sorted({*points, *gone})}


def is_dense(video):
    boxes = [track.in_states(OPTIONS.states) for track in video.tracks]
    return any(frame + 1 in points for points in boxes for frame in points)


@pytest.mark.parametrize(
    ("write", "name", "has_classes"),
    [(write_mot, "clip.txt", False), (write_mot_truth, "clip/gt/gt.txt", True),
     (write_cvat_mot, "clip.zip", True)],
)  # fmt: skip
@given(labelled_videos())
def test_what_is_written_reads_back(tmp_path_factory, write, name, has_classes, video):
    folder = tmp_path_factory.mktemp("mot")
    write([video], folder, OPTIONS)
    seeds = read(folder / name, import_hints(frame_count=video.frame_count))
    assert seeds.name == "clip"
    assert not seeds.notes
    found = {seed.id: seed for seed in seeds.tracks}
    assert found.keys() == {
        labelled.track.id for labelled in video.tracks if labelled.in_states(OPTIONS.states)
    }
    for labelled in video.tracks:
        if labelled.track.id not in found:
            continue
        seed = found[labelled.track.id]
        assert seed.label == (labelled.track.label if has_classes else "object")
        expected = where_labels_are(labelled, video.frame_count)
        if not is_dense(video):
            expected = {frame: point for frame, point in expected.items() if point}
        assert [keyframe.frame for keyframe in seed.keyframes] == list(expected)
        for keyframe, point in zip(seed.keyframes, expected.values(), strict=True):
            assert (keyframe.box is None) == (point is None)
            if keyframe.box and point:
                box, wanted = keyframe.box, point.box
                assert (box.x, box.y, box.width, box.height) == pytest.approx(
                    (wanted.x, wanted.y, wanted.width, wanted.height), abs=0.0011
                )
                assert keyframe.occluded == (has_classes and point.state is not State.VISIBLE)


# ---- what rows mean ----------------------------------------------------------------------------


def test_gaps_and_ends_are_outside(tmp_path):
    path = rows(tmp_path, *(f"{frame},1,2,3,4,5,1" for frame in (4, 2, 3, 7)), "9,2,2,3,4,5,1")
    first, second = read(path, import_hints(frame_count=9)).tracks
    assert [(k.frame, k.box) for k in first.keyframes] == [
        (1, BOX), (2, BOX), (3, BOX), (4, None), (6, BOX), (7, None),
    ]  # fmt: skip
    assert second.keyframes == (Keyframe(8, BOX),)


def test_single_boxes_are_to_go_on_from(tmp_path):
    """Nothing asks for the number of frames."""
    path = rows(tmp_path, "1,1,2,3,4,5,1", "1,2,2,3,4,5,1", "51,1,2,3,4,5,1")
    first, second = read(path).tracks
    assert [k.frame for k in first.keyframes] == [0, 50]
    assert [k.frame for k in second.keyframes] == [0]
    assert first.label == "object"


def test_detections_are_a_track_each(tmp_path):
    path = rows(
        tmp_path, "1,-1,2,3,4,5,0.9", "1,-1,9,9,9,9,0.1", "2,7,2,3,4,5,1", name="det/det.txt"
    )
    seeds = read(path)
    assert seeds.name == tmp_path.name
    assert {t.id: t.keyframes[0].frame for t in seeds.tracks} == {7: 1, 8: 0, 9: 0}
    assert "Boxes of no track (id −1), each now a track to follow: 2;" in seeds.notes[0]


def test_ids_that_count_from_zero_are_moved(tmp_path):
    seeds = read(rows(tmp_path, "1,0,2,3,4,5,1", "1,3,2,3,4,5,1"))
    assert [track.id for track in seeds.tracks] == [1, 4]
    assert "count from 0" in seeds.notes[0]


def test_ground_truth_says_what_to_ignore_and_what_is_hidden(tmp_path):
    path = rows(
        tmp_path,
        "1,1,2,3,4,5,1,1,1", "3,1,2,3,4,5,1,1,0.49", "5,1,2,3,4,5,1,1,0.5", "7,1,2,3,4,5,1,1,-1",
        "1,2,2,3,4,5,0,1,1",
    )  # fmt: skip
    seeds = read(path)
    (track,) = seeds.tracks
    assert [(k.frame, k.occluded) for k in track.keyframes] == [
        (0, False), (2, True), (4, False), (6, False),
    ]  # fmt: skip
    assert track.label == "pedestrian"
    assert seeds.notes == ("Rows left out because their flag is 0, to be ignored: 1.",)


def test_classes_are_named_by_hints_then_by_the_file_beside_then_by_motchallenge(tmp_path):
    lines = [f"1,{number},2,3,4,5,1,{number},1" for number in (1, 2, 3)] + ["1,4,2,3,4,5,1,-1,-1"]
    path = rows(tmp_path, *lines, name="S/gt/gt.txt")
    assert [t.label for t in read(path).tracks] == [
        "pedestrian", "person on vehicle", "car", "object",
    ]  # fmt: skip
    (path.parent / "labels.txt").write_text("ant\nbee\ncow\n")
    hints = import_hints(labels={2: "wasp"})
    assert [t.label for t in read(path, hints).tracks] == ["ant", "wasp", "cow", "object"]
    (path.parent / "labels.txt").write_text("ant\n")
    with pytest.raises(SitupError, match=r"gt\.txt: track 3: class 3 has no name; known are 1, 2"):
        read(path, hints)


def test_what_cannot_be_a_label_is_refused(tmp_path):
    path = rows(tmp_path, "1,1,2,3,4,5,1,2,1", name="S/gt/gt.txt")
    (path.parent / "labels.txt").write_text("ant\nbee\tfly\n")
    with pytest.raises(SitupError, match=r"gt\.txt: track 1: 'bee\\tfly' cannot be a label"):
        read(path)
    with pytest.raises(SitupError, match=r"track 1: ' ' cannot be a label"):
        read(rows(tmp_path, "1,1,2,3,4,5,1"), import_hints(label=" "))


def test_a_class_that_changes_is_noted(tmp_path):
    seeds = read(rows(tmp_path, "1,1,2,3,4,5,1,3,1", "5,1,2,3,4,5,1,1,1"))
    assert seeds.tracks[0].label == "car"
    assert "class changes" in seeds.notes[0]


def test_a_run_of_ours_is_named_after_its_folder(tmp_path):
    assert read(rows(tmp_path, "1,1,2,3,4,5,1", name="street/mot.csv")).name == "street"


def test_pixels_may_count_from_one(tmp_path):
    path = rows(tmp_path, "1,1,2,3,4,5,1")
    (track,) = read(path, import_hints(pixel_origin=1)).tracks
    assert track.keyframes[0].box == BoundingBox(1, 2, 4, 5)


# ---- recognized and refused --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("head", "expected"),
    [
        (b"1,1,2,3,4,5,1", True),
        (b"\xef\xbb\xbf1, 1, 2, 3, 4, 5, 1, -1, -1, -1\r\n1,2", True),
        (b"1,1,2,3,4,5,1,1,1\n", True),
        (b"1,1,2,3,4,5,1,1\n", False),
        (b"0,1,2,3,4,5,1\n", False),
        (b"frame,id,x,y,w,h,conf\n", False),
        (b"1,2,3,4\n", False),
        (b"PK\x03\x04", False),
        (b"\xff\xfe", False),
        (b"", False),
    ],
)
def test_rows_are_recognized_by_the_first(tmp_path, head, expected):
    assert recognizes_mot(tmp_path / "file", head) == expected


def test_an_archive_is_recognized_by_what_is_in_it(tmp_path):
    write_cvat_mot([labelled_video()], tmp_path, OPTIONS)
    path = tmp_path / "clip.zip"
    assert recognizes_mot(path, path.read_bytes()[:100])
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("annotations.xml", "")
    assert not recognizes_mot(path, path.read_bytes()[:100])


def test_a_bad_row_is_named(tmp_path):
    with pytest.raises(SitupError, match=r"clip\.txt: line 2: '1,1,2,3,4,5' is not a row of MOT"):
        read(rows(tmp_path, "1,1,2,3,4,5,1", "1,1,2,3,4,5"))


def test_a_sequence_without_its_length_is_refused(tmp_path):
    path = rows(tmp_path, "1,1,2,3,4,5,1", name="S/gt/gt.txt")
    (tmp_path / "S/seqinfo.ini").write_text("[Sequence]\nname=S\n")
    with pytest.raises(SitupError, match=r"seqinfo\.ini: seqLength is missing"):
        read(path)


@pytest.mark.parametrize("other", ["1,0,2,3,4,5,1", "1,-1,2,3,4,5,1"])
def test_ids_that_leave_none_for_other_tracks_are_refused(tmp_path, other):
    path = rows(tmp_path, f"1,{2**31 - 1},2,3,4,5,1")
    assert read(path).tracks[0].id == 2**31 - 1
    with pytest.raises(SitupError, match=r"clip\.txt: ids go up to 2147483647, so that none"):
        read(rows(tmp_path, f"1,{2**31 - 1},2,3,4,5,1", other))


def test_of_many_known_classes_only_some_are_listed(tmp_path):
    hints = import_hints(labels=dict.fromkeys(range(1, 1000), "a"))
    with pytest.raises(SitupError, match=r"known are 1, 2, .* 20, …; give") as caught:
        read(rows(tmp_path, "1,1,2,3,4,5,1,1000,1"), hints)
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_the_length_of_a_sequence_is_read_however_lines_end(tmp_path, end):
    path = rows(tmp_path, "1,1,2,3,4,5,1", "2,1,2,3,4,5,1", name="S/gt/gt.txt")
    (tmp_path / "S/seqinfo.ini").write_bytes(f"[Sequence]{end} seqlength = 7 {end}".encode())
    assert [k.frame for k in read(path).tracks[0].keyframes] == [0, 1, 2]
