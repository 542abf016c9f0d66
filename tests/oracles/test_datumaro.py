"""datumaro, with which CVAT reads archives, finds the boxes that we wrote."""

import json
import os
import subprocess
import zipfile
from pathlib import Path

import pytest
from support.labelled import labelled_track, labelled_video

from situp_annotate.formats.cvat.exporting import write_cvat
from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.keyframed import keyframes_of
from situp_annotate.formats.mot.exporting import write_cvat_mot, write_mot_truth
from situp_annotate.types import BoundingBox, Provenance, State

PYTHON = os.environ.get("SITUP_ORACLES")
SCRIPT = Path(__file__).with_name("read_with_datumaro.py")
OPTIONS = ExportOptions()

ROUNDING = 0.0101
"""datumaro rounds corners to two decimals, each."""

pytestmark = pytest.mark.skipif(
    not PYTHON, reason="SITUP_ORACLES names no Python that has datumaro (pip install '.[oracles]')"
)


def find(kind, path):
    command = [PYTHON, str(SCRIPT), kind, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture
def video():
    """A car that leaves the picture at its left, comes back, and hides; and a dog."""
    car = {
        frame: (BoundingBox(60.123 - 9.5 * frame, 20, 40 + frame / 3, 30), State.VISIBLE)
        for frame in (*range(10), *range(13, 17))
    }
    car |= {frame: (BoundingBox(5, 20.5, 40, 30), State.OCCLUDED) for frame in range(17, 20)}
    points = {frame: (box, state, Provenance.TRACKED) for frame, (box, state) in car.items()}
    dog = {frame: BoundingBox(600 + frame, 400, 100, 100) for frame in range(5, 10)}
    return labelled_video(
        labelled_track(4, points, "car", {"colour": "red"}), labelled_track(9, dog, "a dog")
    )


def expected_rows(video):
    for labelled in video.tracks:
        for frame, point in labelled.in_states(OPTIONS.states).items():
            box = [
                round(n, 3) for n in (point.box.x, point.box.y, point.box.width, point.box.height)
            ]
            hidden = point.state is State.OCCLUDED
            yield (frame + 1, labelled.track.id), (labelled.track.label, hidden, box)


def found_rows(found):
    for row in found:
        attributes = row["attributes"]
        yield (
            (int(row["item"]), attributes["track_id"]),
            (row["label"], attributes["occluded"], pytest.approx(row["box"], abs=ROUNDING)),
        )
        assert not attributes["ignored"]


@pytest.mark.parametrize("is_archive", [True, False])
def test_ground_truth(tmp_path, video, is_archive):
    if is_archive:
        write_cvat_mot([video], tmp_path, OPTIONS)
        folder = tmp_path / "unpacked"
        with zipfile.ZipFile(tmp_path / "clip.zip") as archive:
            archive.extractall(folder)
    else:
        write_mot_truth([video], tmp_path, OPTIONS)
        folder = tmp_path / "clip"
    assert dict(expected_rows(video)) == dict(found_rows(find("mot_seq", folder)))


def test_keyframes_of_a_cvat_file(tmp_path, video):
    write_cvat([video], tmp_path, OPTIONS)
    found = {(row["frame"], row["attributes"]["track_id"]): row for row in find("cvat", tmp_path)}
    count = 0
    for labelled in video.tracks:
        box = None
        for keyframe in keyframes_of(
            labelled, frame_count=video.frame_count, iou=0.9, states=OPTIONS.states, decimals=2
        ):
            box = keyframe.box or box
            row = found[keyframe.frame, labelled.track.id - 1]
            assert row["label"] == labelled.track.label
            assert row["box"] == pytest.approx([box.x, box.y, box.width, box.height], abs=ROUNDING)
            attributes = row["attributes"]
            assert attributes["keyframe"]
            assert attributes["outside"] == (keyframe.box is None)
            assert attributes["occluded"] == keyframe.occluded
            assert attributes.get("colour") == labelled.track.attributes.get("colour")
            count += 1
    assert count == len(found)
