"""Trails: from where, how long, and that they fade."""

import numpy as np
import pytest

from situp_annotate.formats.overlay.trails import Trail, Trails, draw_trail
from situp_annotate.types import BoundingBox, Frame, Provenance, State, TrackPoint

EMPTY = np.empty((0, 0), np.uint8)
STEP_NS = 100_000_000


def point(index, *, track_id=1, state=State.VISIBLE):
    box = BoundingBox(10.0 * index, 20, 8, 6)
    return TrackPoint(track_id, box, 0.9, state, Provenance.TRACKED)


def frame(index):
    return Frame(index, index * STEP_NS, EMPTY)


def trail_after(labels, *, seconds, track_id=1):
    trails = Trails(seconds)
    for index, points in enumerate(labels):
        trails.note(frame(index), points)
    return trails.of(track_id, frame(len(labels) - 1))


def test_a_trail_goes_back_so_many_seconds():
    trail = trail_after([[point(index)] for index in range(10)], seconds=0.3)
    assert trail.centers_xy == ((64, 23), (74, 23), (84, 23), (94, 23))
    assert trail.ages == pytest.approx((1, 2 / 3, 1 / 3, 0))


@pytest.mark.parametrize("gap", [[], [point(4, state=State.LOST)], [point(4, track_id=2)]])
def test_it_begins_anew_where_nobody_knew(gap):
    labels = [[point(index)] for index in range(8)]
    labels[4] = gap
    assert trail_after(labels, seconds=9).centers_xy == ((54, 23), (64, 23), (74, 23))


def test_there_is_none_without_seconds_or_a_past():
    assert trail_after([[point(index)] for index in range(5)], seconds=0) is None
    assert trail_after([[point(0)]], seconds=1) is None
    assert trail_after([[point(0)], [point(1)], []], seconds=1) is None
    assert trail_after([[point(0)], [point(1)]], seconds=1, track_id=7) is None


def test_it_fades_into_the_picture():
    image = np.zeros((40, 200, 3), np.uint8)
    ages = tuple(np.linspace(1, 0, 10))
    centers = tuple((10.0 + 20 * step, 20.0) for step in range(10))
    draw_trail(image, Trail(centers, ages), (250, 0, 100), 3)
    levels = image[20, 20:180:20, 0].astype(int)
    assert (np.diff(levels) > 0).all()
    assert 180 < image[20, 185, 0] < 250
    np.testing.assert_allclose(image[20, 185], (225, 0, 90), atol=3)
    assert not image[:15].any()


@pytest.mark.parametrize(
    "centers", [((-500.0, -500.0), (-400.0, -300.0)), ((1e12, 5.0), (-1e12, 5.0)),
                ((5.0, 5.0), (5.0, 5.0)), ((-9.0, -9.0), (300.0, 300.0))],
)  # fmt: skip
def test_no_trail_is_too_odd(centers):
    draw_trail(np.zeros((40, 60, 3), np.uint8), Trail(centers, (1.0, 0.0)), (1, 2, 3), 2)
