"""Contact sheets: which frames, and what of them."""

import dataclasses

import numpy as np
import pytest

from situp_annotate.formats.labelled import LabelledTrack
from situp_annotate.formats.overlay.contact_sheet import ContactSheet
from situp_annotate.types import (
    BoundingBox,
    Frame,
    Keyframe,
    Provenance,
    State,
    Track,
    TrackPoint,
)

BOX = BoundingBox(100, 80, 40, 30)
GREEN, ORANGE, RED = (80, 160, 60), (30, 150, 240), (50, 50, 220)


def track(count, *, drawn=(0,), box=BOX, state=State.VISIBLE):
    points = {
        index: TrackPoint(
            1, box, 0.8, state, Provenance.HUMAN if index in drawn else Provenance.TRACKED
        )
        for index in range(count)
    }
    return LabelledTrack(Track(1, "car", (Keyframe(0, box),)), points)


def sheet_of(labelled, *, steps=24, picture=None):
    sheet = ContactSheet("clip", labelled, steps=steps)
    image = np.full((240, 320, 3), 200, np.uint8) if picture is None else picture
    for index in sorted(sheet.frames):
        sheet.add(Frame(index, index * 10**8, image))
    return sheet.image()


def test_regular_steps_and_drawn_boxes():
    sheet = ContactSheet("clip", track(101, drawn=(0, 33, 34)), steps=5)
    assert sorted(sheet.frames) == [0, 25, 33, 34, 50, 75, 100]


def test_few_frames_are_all_there():
    assert sorted(ContactSheet("clip", track(3), steps=24).frames) == [0, 1, 2]


def test_boxes_drawn_everywhere_do_not_fill_the_wall():
    assert len(ContactSheet("clip", track(5000, drawn=range(5000)), steps=24).frames) == 24


@pytest.mark.parametrize(("count", "rows", "columns"), [(1, 1, 1), (6, 1, 6), (7, 2, 6)])
def test_crops_stand_in_rows(count, rows, columns):
    height, width, _ = sheet_of(track(count, drawn=())).shape
    assert height == 37 + rows * (188 + 6)
    assert width >= 6 + columns * (200 + 6)


@pytest.mark.parametrize(
    ("state", "color"),
    [(State.VISIBLE, GREEN), (State.OCCLUDED, ORANGE), (State.LOST, RED)],
)
def test_the_border_tells_the_state(state, color):
    cell = sheet_of(track(1, state=state))[37:225, 6:206]
    assert (cell[:4] == color).all()
    assert (cell[:, -4:] == color).all()


def test_a_crop_shows_the_object_in_its_middle():
    picture = np.zeros((240, 320, 3), np.uint8)
    picture[80:110, 100:140] = (0, 0, 255)
    crop = sheet_of(track(1, drawn=()), picture=picture)[41:185, 10:202]
    middle = crop[60:84, 80:112]
    assert (middle == (0, 0, 255)).all()
    outside = np.concatenate([crop[:20].ravel(), crop[-20:].ravel()])
    assert not outside.any()


@pytest.mark.parametrize(
    "box",
    [BoundingBox(-500, -500, 10, 10), BoundingBox(300, 200, 400, 10), BoundingBox(5, 5, 0.2, 0.1),
     BoundingBox(-1e6, 0, 2e6, 9), BoundingBox(319.9, 239.9, 5, 5),
     BoundingBox(160, 120, 0.001, 0.001)],
)  # fmt: skip
@pytest.mark.parametrize("grey", [False, True])
def test_no_box_is_too_odd(box, grey):
    picture = np.full((240, 320) if grey else (240, 320, 3), 90, np.uint8)
    sheet_of(track(1, box=box), picture=picture)


def test_around_the_smallest_box_something_is_to_be_seen():
    columns = np.arange(320, dtype=np.uint8)[None, :, None]
    picture = np.broadcast_to(columns, (240, 320, 3))
    box = BoundingBox(160, 120, 0.001, 0.001)
    crop = sheet_of(track(1, drawn=(), box=box), picture=picture)[41:185, 10:202]
    assert crop[10, -1, 0] - crop[10, 0, 0] == pytest.approx(24, abs=2)


def test_the_title_fits():
    named = track(1)
    named = dataclasses.replace(named, track=dataclasses.replace(named.track, label="x" * 300))
    assert sheet_of(named).shape[1] > 2000
