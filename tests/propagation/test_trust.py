"""Whom to trust, and what is made of it, on passes drawn by hand."""

import numpy as np
import pytest

from situp_annotate.propagation.fusion import bridge, fuse, overlaps
from situp_annotate.propagation.passes import Pass
from situp_annotate.propagation.trust import Trust

SIZE = 20.0


def a_pass(x, peak, *, backward=False, width=SIZE):
    """A pass in the order of time: boxes at x, all else the same."""
    x = np.asarray(x, float)
    boxes = np.column_stack(
        [x, np.full(len(x), 50.0), np.broadcast_to(width, len(x)), x * 0 + SIZE]
    )
    peak = np.array(np.broadcast_to(peak, len(x)), float)
    peak[-1 if backward else 0] = np.nan
    return Pass(boxes, peak * 50, peak, np.zeros(len(x), bool))


def still(count):
    return np.zeros((count, 2))


def test_overlaps_by_hand():
    boxes = np.array([[0, 0, 2, 2], [0, 0, 2, 2], [0, 0, 1, 1]], float)
    others = np.array([[1, 0, 2, 2], [5, 5, 1, 1], [0, 0, 1, 1]], float)
    assert overlaps(boxes, others) == pytest.approx([1 / 3, 0, 1])


def test_passes_that_agree_are_both_trusted_and_cross_faded():
    forward, backward = a_pass(np.arange(11), 0.6), a_pass(np.arange(11) + 1, 0.6, backward=True)
    fused = fuse(forward, backward, still(11))
    assert (fused.trust == Trust.BOTH).all()
    assert fused.boxes[:, 0] == pytest.approx(np.arange(11) * 1.1)


def test_a_lost_pass_is_left_where_it_is_lost():
    """The forward pass stops following halfway; the backward one never loses the target."""
    truth = 2.0 * np.arange(41)
    forward = a_pass(np.minimum(truth, 40), np.where(truth > 40, 0.1, 0.6))
    fused = fuse(forward, a_pass(truth, 0.6, backward=True), still(41))
    assert (fused.trust[30:] == Trust.BACKWARD).all()
    assert np.abs(fused.boxes[:, 0] - truth).max() < SIZE / 4


def test_where_both_are_lost_the_gap_is_bridged():
    truth = 2.0 * np.arange(61)
    forward = a_pass(np.minimum(truth, 40), np.where(truth > 40, 0.05, 0.6))
    backward = a_pass(np.maximum(truth, 80), np.where(truth < 80, 0.05, 0.6), backward=True)
    fused = fuse(forward, backward, still(61))
    assert (fused.trust[[10, 30, 50]] == [Trust.FORWARD, Trust.NEITHER, Trust.BACKWARD]).all()
    assert np.abs(fused.boxes[:, 0] - truth).max() < SIZE / 4


def test_a_bridge_follows_the_scene_where_the_target_does():
    """A camera that shakes while the target is hidden: straight in the scene, not on the screen."""
    shake = np.where(np.arange(61) % 2, 15.0, -15.0)
    shake[0] = 0
    truth = 2.0 * np.arange(61) + np.cumsum(shake)
    hidden = (np.arange(61) > 20) & (np.arange(61) < 40)
    forward = a_pass(np.where(hidden, truth[20], truth), np.where(np.arange(61) > 20, 0.05, 0.6))
    backward = a_pass(
        np.where(hidden, truth[40], truth), np.where(np.arange(61) < 40, 0.05, 0.6), backward=True
    )
    fused = fuse(forward, backward, np.column_stack([shake, 0 * shake]))
    assert (fused.trust[25:35] == Trust.NEITHER).all()
    assert np.abs(fused.boxes[25:35, 0] - truth[25:35]).max() < 1


def test_a_pass_on_the_background_does_not_win_by_its_high_peak():
    """The backward pass stands still where its keyframe was; only the forward one explains both."""
    truth = 3.0 * np.arange(41)
    backward = a_pass(np.full(41, truth[-1]), 0.9, backward=True)
    fused = fuse(a_pass(truth, 0.35), backward, still(41))
    assert (fused.trust[:30] == Trust.FORWARD).all()


def test_ends_are_the_persons_boxes_to_the_digit():
    forward, backward = a_pass(np.arange(9) / 3, 0.6), a_pass(np.arange(9) / 7, 0.6, backward=True)
    fused = fuse(forward, backward, still(9))
    assert (fused.boxes[0] == forward.boxes[0]).all()
    assert (fused.boxes[-1] == backward.boxes[-1]).all()


def test_a_junction_is_spread_over_the_frames_around():
    """The passes are ten pixels apart where one is left for the other: no step is that large."""
    x = np.arange(81.0)
    early, late = np.where(x > 40, 0.05, 0.6), np.where(x < 40, 0.05, 0.6)
    fused = fuse(a_pass(x, early), a_pass(x + 14, late, backward=True), still(81))
    assert {Trust.FORWARD, Trust.BACKWARD} <= set(fused.trust)
    assert np.abs(np.diff(fused.boxes[:, 0])).max() < 4


@pytest.mark.parametrize("count", [2, 3, 4])
def test_the_shortest_spans(count):
    fused = fuse(
        a_pass(np.zeros(count), 0.6), a_pass(np.ones(count), 0.6, backward=True), still(count)
    )
    assert len(fused.boxes) == count
    assert np.isfinite(fused.boxes).all()


def test_a_longer_stretch_does_not_change_who_is_trusted_far_away():
    """A stretch longer than the longest bridge is no special case."""
    truth = np.arange(700.0) / 4
    forward = a_pass(np.minimum(truth, 20), np.where(truth > 20, 0.05, 0.6))
    fused = fuse(forward, a_pass(truth, 0.6, backward=True), still(700))
    assert (fused.trust[200:] == Trust.BACKWARD).all()


def test_a_bridge_between_two_boxes_goes_with_the_scene_if_the_object_moved_less_there():
    shifts = np.tile([3.0, 0.0], (11, 1))
    first, with_scene, on_screen = (np.array([x, 5.0, 10.0, 10.0]) for x in (20.0, 52.0, 22.0))
    shifts[5] = [-7.0, 0.0]  # 20 in all
    scene = np.cumsum(shifts[:, 0]) - shifts[0, 0]
    expected = 20 + scene + np.linspace(0, 12, 11)
    assert bridge(first, with_scene, shifts)[:, 0] == pytest.approx(expected)
    assert bridge(first, on_screen, shifts)[:, 0] == pytest.approx(np.linspace(20, 22, 11))
