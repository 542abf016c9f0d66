"""Targets of generated folders, with the traps of OTB."""

import json

import numpy as np
import pytest

from situp_annotate.errors import SitupError
from situp_annotate.evaluation.benchmark import attribute_groups, load_targets, set_groups
from situp_annotate.evaluation.otb_frames import scored_pictures
from situp_annotate.video.image_folder import list_images


def write(folder, name, rows, pictures=(), truth="groundtruth_rect.txt"):
    """A sequence with empty pictures, and truth whose x is the row's number."""
    place = folder / name
    (place / "img").mkdir(parents=True, exist_ok=True)
    for picture in pictures:
        (place / "img" / picture).touch()
    (place / truth).write_text("".join(f"{row},2\t3 4\n" for row in range(1, rows + 1)))
    return place


def numbers(first, last, digits=4):
    return [f"{number:0{digits}}.jpg" for number in range(first, last + 1)]


@pytest.mark.parametrize(
    ("name", "rows", "pictures", "first_row", "first_picture", "frames"),
    [
        ("David", 471, numbers(1, 770), 1, "0300.jpg", 471),
        ("David", 471, numbers(300, 770), 1, "0300.jpg", 471),
        ("David", 471, numbers(1, 471), 1, "0001.jpg", 471),
        ("BlurCar1", 742, numbers(247, 988), 1, "0247.jpg", 742),
        ("BlurCar3", 357, numbers(1, 359), 1, "0003.jpg", 357),
        ("BlurCar4", 380, numbers(18, 397), 1, "0018.jpg", 380),
        ("Board", 698, numbers(1, 698, digits=5), 1, "00001.jpg", 698),
        ("Football1", 74, numbers(1, 87), 1, "0001.jpg", 74),
        ("Freeman3", 460, numbers(1, 480), 1, "0001.jpg", 460),
        ("Freeman4", 283, numbers(1, 297), 1, "0001.jpg", 283),
        ("Diving", 215, numbers(1, 231), 1, "0001.jpg", 215),
        ("Tiger1", 354, numbers(1, 354), 6, "0006.jpg", 349),
        ("Tiger1", 349, numbers(1, 354), 1, "0006.jpg", 349),
        ("tiger1", 349, numbers(6, 354), 1, "0006.jpg", 349),
        ("Mine", 5, numbers(1, 9), 1, "0001.jpg", 5),
    ],
)
def test_rows_and_the_pictures_they_belong_to(
    tmp_path, name, rows, pictures, first_row, first_picture, frames
):
    place = write(tmp_path, name, rows, pictures)
    (target,) = load_targets(tmp_path)
    paths = list_images(place)
    places = scored_pictures(target.sequence, paths, len(target.truth))
    assert (len(target.truth), target.truth[0, 0]) == (frames, first_row)
    assert (len(places), paths[places[0]].name) == (frames, first_picture)


def test_numbered_targets_and_only_a_second(tmp_path):
    write(tmp_path, "Jogging", 3, truth="groundtruth_rect.1.txt")
    write(tmp_path, "Jogging", 3, truth="groundtruth_rect.2.txt")
    write(tmp_path, "Human4", 3, truth="groundtruth_rect.2.txt")
    found = [(target.name, target.sequence) for target in load_targets(tmp_path)]
    assert found == [("Human4.2", "Human4"), ("Jogging.1", "Jogging"), ("Jogging.2", "Jogging")]


def test_text_only_with_attributes_and_sets(tmp_path):
    (tmp_path / "ground_truth").mkdir()
    for name in ("Car", "Jogging.1", "Jogging.2"):
        (tmp_path / "ground_truth" / f"{name}.txt").write_text("-1,2,3,4\nNaN NaN NaN NaN\n")
    facts = {
        "car": {"attributes": ["SV", "own", "IV"], "otb50": True, "frames": 2},
        "Jogging": {"attributes": ["IV"], "otb50": False},
        "Jogging-2": {"otb2013": True},
        "Other": {},
    }
    (tmp_path / "attributes.json").write_text(json.dumps(facts))
    targets = load_targets(tmp_path)
    assert [target.folder for target in targets] == [None] * 3
    assert np.isnan(targets[0].truth[1]).all()
    groups = attribute_groups(targets)
    assert groups == {"IV": ["Car", "Jogging.1"], "SV": ["Car"], "own": ["Car"]}
    assert [*groups] == ["IV", "SV", "own"]
    assert set_groups(targets) == {"otb2013": ["Jogging.2"], "otb50": ["Car"]}


def test_attributes_beside_each_sequence(tmp_path):
    (write(tmp_path, "Car", 3) / "attrs.txt").write_text("OCC, SV\n")
    assert load_targets(tmp_path)[0].attributes == ("OCC", "SV")


def test_attributes_of_another_file_win(tmp_path):
    (write(tmp_path, "Car", 3) / "attrs.txt").write_text("OCC")
    other = tmp_path / "mine.json"
    other.write_text('{"Car": {"attributes": ["LR"]}}')
    assert load_targets(tmp_path, other)[0].attributes == ("LR",)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[", r"mine\.json: not valid JSON"),
        ('{"Car": {"attributes": "SV"}}', r"Car\.attributes: .*give for each name an object"),
        ('{"Bus": {"attributes": ["SV"]}}', r"says nothing of Car or any other sequence"),
    ],
)
def test_attributes_that_cannot_be_used(tmp_path, text, message):
    write(tmp_path, "Car", 3)
    (tmp_path / "mine.json").write_text(text)
    with pytest.raises(SitupError, match=message):
        load_targets(tmp_path, tmp_path / "mine.json")


def test_truth_without_a_box(tmp_path):
    write(tmp_path, "Car", 0)
    with pytest.raises(SitupError, match="Car: there is no box"):
        load_targets(tmp_path)


def test_no_truth_at_all(tmp_path):
    (tmp_path / "ground_truth").mkdir()
    with pytest.raises(SitupError, match="no truth here"):
        load_targets(tmp_path)
