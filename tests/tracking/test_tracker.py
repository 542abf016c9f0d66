"""The tracker on pictures whose motion is known by construction."""

import math

import cv2
import numpy as np
import pytest

from situp_annotate.errors import TrackingError
from situp_annotate.tracking import SitupTracker, TrackerParams
from situp_annotate.tracking.window import search_windows
from situp_annotate.types import BoundingBox


def textured(height=160, width=200, channels=3, seed=0):
    """A smooth random texture, uint8."""
    noise = np.random.default_rng(seed).uniform(0, 255, (height, width, channels))
    smooth = cv2.GaussianBlur(noise, (0, 0), 3).reshape(height, width, channels)
    smooth = (smooth - smooth.min()) / (smooth.max() - smooth.min()) * 255
    return smooth.astype(np.uint8) if channels == 3 else smooth[..., 0].astype(np.uint8)


@pytest.mark.parametrize("channels", [1, 3], ids=["grey", "colour"])
@pytest.mark.parametrize("shift", [(8, 0), (0, 8), (-8, 12), (-4, -4)])
def test_known_shift_moves_the_box_by_as_much(channels, shift):
    image = textured(channels=channels)
    tracker = SitupTracker(TrackerParams(scale_factors=(1.0,)))
    tracker.init(image, BoundingBox(80, 60, 40, 32))
    box = tracker.update(np.roll(image, shift, (0, 1))).box
    assert (box.y - 60, box.x - 80, box.width, box.height) == (*shift, 40, 32)


def test_still_picture_keeps_the_box_for_good():
    image = textured()
    tracker = SitupTracker()
    tracker.init(image, BoundingBox(80, 60, 40, 32))
    for _ in range(5):
        estimate = tracker.update(image)
    assert estimate.box == BoundingBox(80, 60, 40, 32)
    assert estimate.scale == 1


def zoomed(image, center, factor):
    matrix = cv2.getRotationMatrix2D(center, 0, factor)
    return cv2.warpAffine(image, matrix, image.shape[1::-1], borderMode=cv2.BORDER_REFLECT)


def test_scale_is_followed_up_and_down():
    """The sampling grid of the authors' code stretches rows by both axes' ratios, so that the
    scale found lies between the true one and its power of two thirds.
    """
    image = textured(240, 320)
    tracker = SitupTracker()
    tracker.init(image, BoundingBox(130, 90, 60, 60))
    factors = [1.008**step for step in [*range(1, 41), *range(39, 0, -1)]]
    scales = [tracker.update(zoomed(image, (160, 120), factor)).scale for factor in factors]
    assert factors[39] ** 0.5 < scales[39] < factors[39]
    assert scales[-1] == pytest.approx(1.0, abs=0.05)


def test_large_targets_are_tracked_at_half_size():
    image = textured(480, 640)
    tracker = SitupTracker(TrackerParams(scale_factors=(1.0,)))
    tracker.init(image, BoundingBox(199, 159, 160, 120))
    box = tracker.update(np.roll(image, (16, -24), (0, 1))).box
    assert (box.x, box.y, box.width, box.height) == (175, 175, 160, 120)


def test_a_target_that_vanishes_never_raises_and_loses_sharpness():
    image = textured()
    tracker = SitupTracker()
    tracker.init(image, BoundingBox(80, 60, 40, 32))
    seen = tracker.update(image)
    gone = [tracker.update(np.zeros_like(image)) for _ in range(5)]
    assert all(estimate.apce < seen.apce / 2 for estimate in gone)


def test_locating_changes_nothing_and_learning_follows_the_box():
    image, moved = textured(), np.roll(textured(), (8, 12), (0, 1))
    tracker, twin = SitupTracker(), SitupTracker()
    for each in (tracker, twin):
        each.init(image, BoundingBox(80, 60, 40, 32))
    located = [tracker.locate(moved) for _ in range(2)]
    candidates = tracker.candidates(moved)
    assert len(candidates) == len(TrackerParams().scale_factors)
    assert max(candidates, key=lambda each: each.apce) == located[0] == located[1]
    assert tracker.update(moved) == twin.update(moved) == located[0]

    tracker.learn(image, BoundingBox(80, 60, 40, 32))
    assert tracker.locate(image).box == BoundingBox(80, 60, 40, 32)


def test_pictures_of_every_memory_layout_are_one_to_it():
    """Kernels are compiled for one kind of array: views, read-only and reversed pictures fit."""
    image = textured()
    reverse = np.ascontiguousarray(image[:, :, ::-1])[:, :, ::-1]
    frozen = image.copy()
    frozen.setflags(write=False)
    boxes = []
    for picture in (image, reverse, frozen, np.asfortranarray(image)):
        tracker = SitupTracker()
        tracker.init(picture, BoundingBox(80, 60, 40, 32))
        boxes.append(tracker.update(np.roll(picture, 4, 0)))
    assert boxes == boxes[:1] * 4
    assert len(search_windows.signatures) == 1


def test_wrong_pictures_are_refused():
    tracker = SitupTracker()
    with pytest.raises(TrackingError, match="call init"):
        tracker.update(textured())
    with pytest.raises(TrackingError, match="uint8 array of shape"):
        tracker.init(textured().astype(float), BoundingBox(0, 0, 9, 9))
    tracker.init(textured(), BoundingBox(80, 60, 40, 32))
    with pytest.raises(TrackingError, match="all must be the same"):
        tracker.update(textured(100, 100))


def test_input_is_not_modified():
    image = textured()
    before = image.copy()
    image.setflags(write=False)
    tracker = SitupTracker()
    tracker.init(image, BoundingBox(80, 60, 40, 32))
    tracker.update(image)
    np.testing.assert_array_equal(image, before)


@pytest.mark.parametrize(
    "values",
    [{"padding": 0.5}, {"cell_size": 1}, {"learning_rate": 2.0}, {"scale_factors": ()},
     {"scale_factors": (1.0,) * 33}, {"regularization": math.nan}, {"halve_above": math.inf}],
)  # fmt: skip
def test_parameters_out_of_range_are_refused(values):
    with pytest.raises(TrackingError, match="is not allowed: give"):
        TrackerParams(**values)


@pytest.mark.parametrize("pixels", [1, 2, 3])
def test_the_fine_box_sees_motion_of_less_than_a_cell(pixels):
    image = textured()
    tracker = SitupTracker(TrackerParams(scale_factors=(1.0,)))
    tracker.init(image, BoundingBox(80, 60, 40, 32))
    estimate = tracker.update(np.roll(image, pixels, axis=1))
    assert estimate.box.x in (80, 84)
    assert abs(estimate.fine_box.x - 80 - pixels) < abs(estimate.box.x - 80 - pixels)


@pytest.mark.parametrize("size", [32, 120], ids=["whole", "halved"])
def test_a_target_that_moves_with_the_scene_is_found_beyond_its_window(size):
    image, shift = textured(480, 640), (1.5 * size, -size)
    moved = np.roll(image, (int(shift[1]), int(shift[0])), (0, 1))
    tracker = SitupTracker(TrackerParams(scale_factors=(1.0,)))
    tracker.init(image, BoundingBox(240, 200, size, size))
    assert abs(tracker.locate(moved).box.x - 240 - shift[0]) > size / 2
    box = tracker.update(moved, shift).box
    assert (box.x - 240, box.y - 200) == pytest.approx(shift, abs=1)


def test_a_target_that_stays_while_the_scene_moves_is_kept():
    image = textured()
    tracker = SitupTracker()
    tracker.init(image, BoundingBox(80, 60, 40, 32))
    for _ in range(3):  # more than once: spectra of the place that lost must not be learnt
        assert tracker.update(image, (30.0, 20.0)).box == BoundingBox(80, 60, 40, 32)


def test_a_copy_goes_its_own_way():
    image = textured()
    tracker = SitupTracker()
    tracker.init(image, BoundingBox(80, 60, 40, 32))
    twin = tracker.copy()
    before = twin.locate(np.roll(image, 4, 1))
    for _ in range(3):
        tracker.update(textured(seed=1))
    assert twin.locate(np.roll(image, 4, 1)) == before
    assert twin.update(np.roll(image, 4, 1)) == before
    assert tracker.locate(image) != before
