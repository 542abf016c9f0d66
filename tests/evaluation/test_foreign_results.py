"""Boxes of other trackers, from text and from files of MATLAB, whole and broken."""

import numpy as np
import pytest
import scipy.io

from situp_annotate.errors import SitupError
from situp_annotate.evaluation.benchmark import Target
from situp_annotate.evaluation.foreign_results import read_results
from situp_annotate.evaluation.mat_results import read_mat_boxes

BOXES = np.arange(1.0, 21).reshape(5, 4)


def target(name, sequence=None, frames=5, folder=None):
    return Target(name, sequence or name, np.ones((frames, 4)), folder)


def write(folder, name, boxes=BOXES, **fields):
    folder.mkdir(exist_ok=True)
    if name.endswith(".mat"):
        cell = np.empty((1, 1), object)
        cell[0, 0] = {"res": boxes, "type": "rect", "startFrame": 1, **fields}
        scipy.io.savemat(folder / name, {"results": cell})
    else:
        np.savetxt(folder / name, boxes, delimiter=",")


def read(folder, *targets):
    return read_results("kcf", str(folder), targets).boxes


@pytest.mark.parametrize(
    ("file", "name", "sequence"),
    [
        ("Car4.txt", "Car4", "Car4"),
        ("car4_KCF.txt", "Car4", "Car4"),
        ("CAR4_KCF.MAT", "Car4", "Car4"),
        ("Jogging.1.txt", "Jogging.1", "Jogging"),
        ("Jogging-1.txt", "Jogging.1", "Jogging"),
        ("jogging_1_kcf.mat", "Jogging.1", "Jogging"),
        ("Human4_KCF.txt", "Human4.2", "Human4"),
    ],
)
def test_names_of_files(tmp_path, file, name, sequence):
    if file == "CAR4_KCF.MAT":
        write(tmp_path, "a.mat")
        (tmp_path / "a.mat").rename(tmp_path / file)
    else:
        write(tmp_path, file)
    np.testing.assert_array_equal(read(tmp_path, target(name, sequence))[name], BOXES)


def test_names_that_begin_alike_are_not_confused(tmp_path):
    for file in ("Car1.txt", "Car1_KCF.txt", "Car12_KCF.txt", "Jogging-2.txt"):
        write(tmp_path, file)
    targets = [target("Car1"), target("Car2"), target("Jogging.1", "Jogging")]
    assert [*read(tmp_path, *targets, target("Jogging.2", "Jogging"))] == ["Car1", "Jogging.2"]


def test_two_files_of_a_target(tmp_path):
    write(tmp_path, "Car1_KCF.txt")
    write(tmp_path, "Car1_DCF.txt")
    with pytest.raises(SitupError, match=r"Car1_DCF\.txt: Car1_KCF\.txt beside it is of the same"):
        read(tmp_path, target("Car1"))


def test_files_beside_each_truth(tmp_path):
    write(tmp_path / "Jogging", "authors.2.txt")
    write(tmp_path / "Car", "authors.txt", BOXES + 1)
    targets = [
        target("Car", folder=tmp_path / "Car"),
        target("Jogging.2", "Jogging", folder=tmp_path / "Jogging"),
    ]
    found = read_results("them", "authors", targets)
    assert [*found.boxes] == ["Car", "Jogging.2"]
    np.testing.assert_array_equal(found.boxes["Car"], BOXES + 1)


@pytest.mark.parametrize("place", ["nothing", "../Car/authors"])
def test_no_boxes_at_all(tmp_path, place):
    write(tmp_path / "Car", "authors.txt")
    with pytest.raises(SitupError, match=f"{place}: no boxes of Car"):
        read(place, target("Car", folder=tmp_path / "Car"))


def test_fewer_boxes_than_truth(tmp_path):
    write(tmp_path, "Car.txt", BOXES[:4])
    with pytest.raises(SitupError, match=r"Car\.txt: 4 boxes, but the truth of Car has 5"):
        read(tmp_path, target("Car"))


def test_tiger_with_and_without_its_first_five_rows(tmp_path):
    rows = np.tile(np.arange(1.0, 355)[:, np.newaxis], 4)
    for name, boxes in {"a": rows, "b": rows[5:]}.items():
        write(tmp_path / name, "Tiger1.txt", boxes)
        assert read(tmp_path / name, target("Tiger1", frames=349))["Tiger1"][0, 0] == 6


@pytest.mark.parametrize(("start", "first"), [(300, 1), (298, 3), (1, 300)])
def test_start_of_a_file_of_matlab(tmp_path, start, first):
    rows = np.tile(np.arange(1.0, 771)[:, np.newaxis], 4)
    write(tmp_path, "David.mat", rows, startFrame=start)
    assert read(tmp_path, target("David"))["David"][0, 0] == first


def test_first_of_several_runs_and_numbers_that_are_none(tmp_path):
    boxes = BOXES.copy()
    boxes[1, 2] = np.inf
    cell = np.empty((1, 2), object)
    cell[0, 0], cell[0, 1] = {"res": boxes, "type": "rect"}, {"res": BOXES[1:], "type": "rect"}
    scipy.io.savemat(tmp_path / "a.mat", {"results": cell})
    found, start = read_mat_boxes(tmp_path / "a.mat")
    assert (len(found), start) == (5, None)
    assert np.isnan(found[1, 2])


def test_one_box_and_whole_numbers(tmp_path):
    write(tmp_path, "a.mat", np.array([[1, 2, 3, 4]], np.uint8))
    np.testing.assert_array_equal(read_mat_boxes(tmp_path / "a.mat")[0], [[1, 2, 3, 4]])


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"type": "ivtAff"}, r"type is 'ivtAff'; only 'rect'"),
        ({"type": 3}, r"type is '3'"),
        ({"shiftType": "left"}, "shifted boxes"),
        ({"startFrame": "x"}, r"startFrame is 'x'"),
        ({"startFrame": 0}, r"startFrame is '0'"),
        ({"boxes": np.ones((5, 6))}, r"res is float64 \(5, 6\)"),
        ({"boxes": np.ones((5, 4)) * 1j}, "res is complex128"),
        ({"boxes": np.ones((2, 5, 4))}, r"\(2, 5, 4\)"),
        ({"boxes": "text"}, "not numbers"),
    ],
)
def test_structures_that_are_something_else(tmp_path, fields, message):
    write(tmp_path, "a.mat", **fields)
    with pytest.raises(SitupError, match=message):
        read_mat_boxes(tmp_path / "a.mat")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"other": 1}, "has no variable 'results'"),
        ({"results": 1}, "holds no structure"),
        ({"results": np.empty((0, 0))}, "holds no structure"),
        ({"results": np.array(["a", "b"], object)}, "holds no structure"),
        ({"results": {"type": "rect"}}, "not numbers"),
    ],
)
def test_other_variables(tmp_path, content, message):
    scipy.io.savemat(tmp_path / "a.mat", content)
    with pytest.raises(SitupError, match=message):
        read_mat_boxes(tmp_path / "a.mat")


def damaged(path):
    whole = path.read_bytes()
    yield b""
    yield b"no file of MATLAB at all" * 20
    yield b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(64)
    for length in (60, 127, 140, 200, len(whole) - 9):
        yield whole[:length]
    for place in range(120, len(whole), 17):
        yield whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :]


def test_damaged_files_are_errors_or_boxes(tmp_path):
    write(tmp_path, "a.mat")
    path = tmp_path / "b.mat"
    for content in damaged(tmp_path / "a.mat"):
        path.write_bytes(content)
        try:
            boxes, _ = read_mat_boxes(path)
        except SitupError as error:
            assert str(error).startswith(str(path))  # noqa: PT017 - either will do
        else:
            assert boxes.shape[1] == 4


def test_a_missing_file(tmp_path):
    with pytest.raises(SitupError, match="cannot be read"):
        read_mat_boxes(tmp_path / "none.mat")
