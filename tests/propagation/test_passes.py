"""Following a target from a keyframe on, losing it, and finding it again."""

import cv2
import numpy as np
import pytest
from support.sliding import BOX, Sliding

from situp_annotate.propagation.camera import CameraMotion
from situp_annotate.propagation.passes import Follower, peak_evidence
from situp_annotate.tracking import SitupTracker
from situp_annotate.types import BoundingBox, Keyframe


def textured(height, width, seed):
    noise = np.random.default_rng(seed).uniform(0, 255, (height, width, 3))
    smooth = cv2.GaussianBlur(noise, (0, 0), 2)
    return cv2.normalize(smooth, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)


BACKGROUND, OBJECT = textured(200, 300, 0), textured(40, 40, 1)


def picture(x):
    """The object at x, or nowhere."""
    image = BACKGROUND.copy()
    if x is not None:
        image[80:120, x : x + 40] = OBJECT
    return image


def follow(places, *, search=True):
    keyframe = Keyframe(0, BoundingBox(places[0], 80, 40, 40))
    follower = Follower(keyframe, picture(places[0]), SitupTracker, search=search)
    for x in places[1:]:
        follower.step(picture(x), (0.0, 0.0))
    return follower.finish()


def test_a_pass_notes_boxes_and_responses():
    follower = Follower(Keyframe(3, BOX), np.zeros((50, 60), np.uint8), Sliding, search=True)
    for _ in range(2):
        follower.step(np.zeros((50, 60), np.uint8), (0.0, 0.0))
    one = follower.finish()
    assert one.boxes[:, 0] == pytest.approx([10, 11, 12])
    assert np.isnan([one.peak[0], one.apce[0]]).all()
    assert (one.peak[1:] == 0.5).all()
    assert one.reversed().boxes[0, 0] == 12
    assert len(one.head(2)) == 2


def test_a_target_in_view_is_never_lost():
    one = follow([100 + step for step in range(40)])
    assert not one.lost.any()
    assert one.boxes[-1, 0] == pytest.approx(139, abs=2)


def test_a_target_that_goes_is_lost_from_the_frame_on_and_found_where_it_comes_back():
    places = [60] * 8 + [None] * 25 + [130] * 15
    one = follow(places)
    assert not one.lost[:8].any()
    assert one.lost[10:33].all()
    assert not one.lost[-8:].any()
    assert one.boxes[-1, 0] == pytest.approx(130, abs=3)


def test_without_search_nothing_is_given_up():
    assert not follow([60] * 8 + [None] * 20, search=False).lost.any()


def test_a_follower_can_be_told_that_the_scene_moves():
    follower = Follower(
        Keyframe(0, BoundingBox(60, 80, 40, 40)), picture(60), SitupTracker, search=False
    )
    follower.step(np.roll(picture(60), 90, axis=1), (90.0, 0.0))
    assert follower.finish().boxes[-1, 0] == pytest.approx(150, abs=1)


def test_evidence_grows_with_the_peak_and_is_bounded():
    evidence = peak_evidence(np.array([np.nan, 0.0, 0.25, 0.3, 0.6, 0.9]))
    assert evidence[0] == evidence[2] == 0
    assert (np.diff(evidence[1:]) >= 0).all()
    assert evidence[1] == -evidence[-1]


@pytest.mark.parametrize("shift", [(7, 0), (-5, 9), (0, -12)])
@pytest.mark.parametrize("channels", [1, 3])
def test_the_cameras_motion_is_measured(shift, channels):
    image = textured(240, 320, 2)[..., :channels].squeeze()
    camera = CameraMotion()
    assert camera(image) == (0, 0)
    moved = np.roll(image, shift[::-1], axis=(0, 1))
    assert camera(moved) == pytest.approx(shift, abs=1)


def test_what_cannot_be_the_cameras_motion_is_none():
    camera = CameraMotion()
    for image in (BACKGROUND * 0, BACKGROUND * 0, BACKGROUND, textured(200, 300, 9)):
        x, y = camera(image)
        assert abs(x) <= 90
        assert abs(y) <= 60
    assert CameraMotion()(np.zeros((1, 1), np.uint8)) == (0, 0)
