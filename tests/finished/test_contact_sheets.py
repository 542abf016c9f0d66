"""A contact sheet for each track that has a box."""

import dataclasses

import numpy as np
import pytest
from PIL import Image as Pillow
from support.counting import COUNT, labelled, write_counting

from situp_annotate.finished.contact_sheets import write_contact_sheets


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    return labelled(write_counting(tmp_path_factory.mktemp("clips") / "clip.mp4"))


def test_one_a_track(video, tmp_path):
    told = []
    write_contact_sheets(video, tmp_path, steps=10, on_frame=lambda: told.append(1))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["track-1.png", "track-2.png"]
    assert len(told) == COUNT
    colors = []
    for number in (1, 2):
        with Pillow.open(tmp_path / f"track-{number}.png") as sheet:
            colors.append(tuple(np.asarray(sheet)[38, 8]))
    assert colors == [(60, 160, 80), (220, 50, 50)]  # visible and lost


def test_none_without_boxes(video, tmp_path):
    empty = dataclasses.replace(video.tracks[1], points={})
    some = dataclasses.replace(video, tracks=(video.tracks[0], empty))
    write_contact_sheets(some, tmp_path, steps=10, threads=2)
    assert [path.name for path in tmp_path.iterdir()] == ["track-1.png"]


def test_a_sheet_is_written_when_its_last_frame_has_come(video, tmp_path):
    first, second = video.tracks
    early = {frame: point for frame, point in first.points.items() if frame < 5}
    some = dataclasses.replace(video, tracks=(dataclasses.replace(first, points=early), second))
    there = []
    write_contact_sheets(
        some, tmp_path, steps=10, on_frame=lambda: there.append(len([*tmp_path.iterdir()]))
    )
    assert there == [0] * 4 + [1] * (COUNT - 5) + [2]
