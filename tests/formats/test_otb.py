"""OTB ground truth: however its lines are written."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.labelled import import_hints

from situp_annotate.errors import SitupError
from situp_annotate.formats.otb import read_boxes, read_otb, recognizes_otb
from situp_annotate.types import BoundingBox, Keyframe

HINTS = import_hints()


def truth(folder, text, name="Car/groundtruth_rect.txt"):
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def test_lines_may_be_separated_in_any_way(tmp_path):
    path = truth(tmp_path, "1,2,3,4\r\n5\t6\t7\t8\n9 10  11 12\n\n13, 14\t,15 16 \n")
    np.testing.assert_array_equal(read_boxes(path), np.arange(1, 17).reshape(4, 4))


def test_pixels_count_from_one_unless_it_is_said(tmp_path):
    path = truth(tmp_path, "11,21,30,40\n")
    (seeds,) = read_otb(path, HINTS)
    assert (seeds.name, seeds.tracks[0].id, seeds.tracks[0].label) == ("Car", 1, "object")
    assert seeds.tracks[0].keyframes == (Keyframe(0, BoundingBox(10, 20, 30, 40)),)
    (seeds,) = read_otb(path, import_hints(pixel_origin=0))
    assert seeds.tracks[0].keyframes[0].box == BoundingBox(11, 21, 30, 40)


def test_a_label_is_one_line(tmp_path):
    path = truth(tmp_path, "11,21,30,40\n")
    with pytest.raises(SitupError, match=r"groundtruth_rect\.txt: 'a\\nb' cannot be a label"):
        read_otb(path, import_hints(label="a\nb"))


def test_an_absent_object_is_outside(tmp_path):
    path = truth(
        tmp_path, "NaN,NaN,NaN,NaN\n1,1,2,2\n0,0,0,0\n5,5,-1,5\n1,nan,2,2\n1,1,2,2\n0 0 0 0"
    )
    (seeds,) = read_otb(path, HINTS)
    box = BoundingBox(0, 0, 2, 2)
    assert seeds.tracks[0].keyframes == (
        Keyframe(1, box),
        Keyframe(2, None),
        Keyframe(5, box),
        Keyframe(6, None),
    )


@pytest.mark.parametrize(
    ("name", "sequence", "number"),
    [
        ("Jogging/groundtruth_rect.2.txt", "Jogging", 2),
        ("Jogging/groundtruth_rect.0.txt", "Jogging", 1),
        ("street.txt", "street", 1),
    ],
)
def test_names_tell_sequence_and_target(tmp_path, name, sequence, number):
    (seeds,) = read_otb(truth(tmp_path, "1,1,2,2\n", name), HINTS)
    assert (seeds.name, seeds.tracks[0].id) == (sequence, number)


def test_numbered_files_are_targets_of_one_sequence(tmp_path):
    for number in (10, 2):
        path = truth(tmp_path, f"{number},1,2,2\n", f"Jogging/groundtruth_rect.{number}.txt")
    truth(tmp_path, "no box", "Jogging/groundtruth_rect.txt")
    (seeds,) = read_otb(path, HINTS)
    assert [(t.id, t.keyframes[0].box.x) for t in seeds.tracks] == [(2, 1), (10, 9)]


@given(st.lists(st.none() | st.tuples(*[st.floats(-1e4, 1e4)] * 2, *[st.floats(0.1, 1e4)] * 2)))
def test_every_box_is_a_keyframe(tmp_path_factory, boxes):
    lines = ["NaN NaN NaN NaN" if box is None else " ".join(map(repr, box)) for box in boxes]
    path = truth(tmp_path_factory.mktemp("otb"), "\n".join(lines))
    if not any(boxes):
        with pytest.raises(SitupError, match="there is no box"):
            read_otb(path, HINTS)
        return
    (seeds,) = read_otb(path, import_hints(pixel_origin=0))
    found = {k.frame: k.box for k in seeds.tracks[0].keyframes}
    expected = {frame: BoundingBox(*box) for frame, box in enumerate(boxes) if box}
    assert {frame: box for frame, box in found.items() if box} == expected
    gone = {f + 1 for f in expected if f + 1 not in expected and f + 1 < len(boxes)}
    assert {frame for frame, box in found.items() if box is None} == gone


@pytest.mark.parametrize(
    "line", ["1,2,3", "1,2,3,4,5", "a b c d", "1,2,3,inf", "1,2,3,1e400", "1,,2,3"]
)
def test_other_lines_are_named(tmp_path, line):
    with pytest.raises(SitupError, match=r"rect\.txt: line 3: .* is not a box; give four numbers"):
        read_otb(truth(tmp_path, f"1,2,3,4\n\n{line}\n"), HINTS)


@pytest.mark.parametrize("name", ["none.txt", "groundtruth_rect.1.txt"])
def test_files_that_cannot_be_read_are_named(tmp_path, name):
    with pytest.raises(SitupError, match=rf"{name}: cannot be read"):
        read_otb(tmp_path / name, HINTS)


@pytest.mark.parametrize(
    ("name", "head", "expected"),
    [
        ("groundtruth_rect.txt", b"", True),
        ("a.txt", b"1\t2\t3\t4\r\n", True),
        ("a.txt", b"NaN,NaN,NaN,NaN\n", True),
        ("a.txt", b"1,2,3,4,5\n", False),
        ("a.txt", b"{}", False),
        ("a.txt", b"\xff", False),
        ("a.txt", b"", False),
    ],
)
def test_files_are_recognized_by_name_or_first_line(tmp_path, name, head, expected):
    assert recognizes_otb(tmp_path / name, head) == expected


@pytest.mark.parametrize("box", ["1e300,2,3,4", "1,2,1e300,4"])
def test_boxes_beyond_all_pictures_are_named(tmp_path, box):
    with pytest.raises(SitupError, match=r"rect\.txt: box 2: A box needs four finite numbers"):
        read_otb(truth(tmp_path, f"1,2,3,4\n{box}\n"), HINTS)


def test_a_suffix_is_no_pattern(tmp_path):
    truth(tmp_path, "1,2,3,4\n", "groundtruth_rect.2.txt")
    (seeds,) = read_otb(truth(tmp_path, "1,2,3,4\n", "groundtruth_rect.1.**"), HINTS)
    assert [track.id for track in seeds.tracks] == [1]
