"""What must hold of any picture, box and motion."""

import math

import cv2
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from situp_annotate.tracking import SitupTracker, TrackerParams
from situp_annotate.tracking.correlation import CorrelationFilter, gaussian_labels, respond
from situp_annotate.tracking.fourier import invert, plan_transform, transform
from situp_annotate.tracking.response import find_peak
from situp_annotate.types import BoundingBox

few = settings(max_examples=15, deadline=None)
seeds = st.integers(0, 2**16)
cells = st.integers(-2, 2)
sizes = st.sampled_from([1, 2, 3, 17, 40, 90, 160, 300])
corners = st.integers(-200, 400)


def textured(height, width, seed):
    """A smooth random colour texture that wraps around."""
    noise = np.random.default_rng(seed).uniform(0, 255, (3, height, width))
    smooth = np.stack([cv2.GaussianBlur(np.tile(plane, (2, 2)), (0, 0), 3) for plane in noise], -1)
    smooth = smooth[height // 2 : height // 2 + height, width // 2 : width // 2 + width]
    stretched = (smooth - smooth.min()) / (smooth.max() - smooth.min()) * 255
    return np.ascontiguousarray(stretched.astype(np.uint8))


def track(frames, box, params=None):
    tracker = SitupTracker(params)
    tracker.init(frames[0], box)
    return [tracker.update(frame).box for frame in frames[1:]]


@few
@given(seeds, st.integers(6, 20), st.integers(6, 20), st.data())
def test_rolled_features_roll_the_response(seed, rows, columns, data):
    down, right = data.draw(st.integers(0, rows - 1)), data.draw(st.integers(0, columns - 1))
    maps = np.random.default_rng(seed).normal(size=(columns, rows, 4)).astype(np.float32)
    plan = plan_transform((rows, columns), 4)
    x_f, z_f = np.empty((2, rows, 2, columns // 2 + 1, 4), np.float32)
    transform(maps, plan, x_f)
    transform(np.roll(maps, (right, down), (0, 1)), plan, z_f)
    learnt = CorrelationFilter(gaussian_labels((rows, columns), 1.0), x_f.shape, maps.size, 3e-4)
    learnt.learn(x_f, 1.0)
    responses_f = np.empty((rows, 2, columns // 2 + 1, 2), np.float32)
    for n, spectrum in enumerate((x_f, z_f)):
        respond(spectrum, learnt.model, responses_f[..., n])
    responses = np.empty((2, rows, columns), np.float32)
    invert(responses_f, plan, responses)
    assert find_peak(responses[0]).offset_yx == (0, 0)
    expected = np.roll(responses[0], (down, right), (0, 1))
    np.testing.assert_allclose(responses[1], expected, atol=1e-4)


@few
@given(seeds, st.lists(st.tuples(cells, cells), min_size=1, max_size=3))
def test_a_mirrored_video_gives_mirrored_boxes(seed, moves):
    """By whole cells, since the authors' sampling grid lies a pixel off the middle."""
    frames = [textured(160, 200, seed)]
    for down, right in moves:
        frames.append(np.roll(frames[-1], (4 * down, 4 * right), (0, 1)))
    params = TrackerParams(scale_factors=(1.0,))
    boxes = track(frames, BoundingBox(80, 64, 40, 32), params)
    mirrored = track([frame[:, ::-1] for frame in frames], BoundingBox(80, 64, 40, 32), params)
    for box, other in zip(boxes, mirrored, strict=True):
        assert (other.x, other.y) == (200 - box.x - box.width, box.y)


@few
@given(seeds, st.lists(st.tuples(cells, cells), min_size=1, max_size=3))
def test_half_the_picture_and_box_give_half_the_boxes(seed, moves):
    frames = [textured(240, 320, seed)]
    for down, right in moves:
        frames.append(np.roll(frames[-1], (4 * down, 4 * right), (0, 1)))
    halves = [cv2.resize(frame, (160, 120), interpolation=cv2.INTER_AREA) for frame in frames]
    boxes = track(frames, BoundingBox(120, 80, 64, 64))
    smaller = track(halves, BoundingBox(60, 40, 32, 32))
    for box, half in zip(boxes, smaller, strict=True):
        # A cell is four pixels in either picture, so positions agree to half a cell of the larger.
        assert abs(half.x - box.x / 2) <= 4
        assert abs(half.y - box.y / 2) <= 4
        assert abs(half.width / box.width - 0.5) < 0.05


@few
@given(corners, corners, sizes, sizes, seeds)
def test_boxes_stay_finite_wherever_they_are(x, y, width, height, seed):
    """At the border, beyond it, of a pixel or two, larger than the picture."""
    tracker = SitupTracker()
    tracker.init(textured(160, 200, 0), BoundingBox(x, y, width, height))
    for step in range(3):
        estimate = tracker.update(textured(160, 200, seed + step))
        assert all(map(math.isfinite, (estimate.apce, estimate.peak, estimate.box.x)))
        assert estimate.box.width > 0
        assert estimate.scale > 0


@few
@given(seeds, st.integers(5, 20))
def test_a_target_that_leaves_for_good_never_raises(seed, count):
    image = textured(120, 160, seed)
    box = BoundingBox(60, 40, 40, 32)
    frames = [image] + [np.roll(image, 12 * step, 1) for step in range(1, 5)]
    frames += [np.full_like(image, 128)] * count
    boxes = track(frames, box)
    assert all(math.isfinite(each.x) and each.width > 0 for each in boxes)
