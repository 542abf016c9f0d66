"""Propagation with a tracker whose every answer is known."""

from dataclasses import replace

import pytest
from support.sliding import BOX, OTHER, Sliding, Still, footage

from situp_annotate.propagation import PropagationOptions, propagate
from situp_annotate.types import (
    BoundingBox,
    Extend,
    Keyframe,
    Method,
    Provenance,
    State,
    Track,
)

FORWARD = PropagationOptions(direction="forward")


@pytest.fixture(autouse=True)
def _no_starts():
    Sliding.starts = 0


def label(track, count=10, options=None, **settings):
    """Labels of one track by frame, None where it has no box; and the keyframes skipped."""
    labels = propagate(footage(count), [track], options, **{"tracker": Sliding, **settings})
    points = [points[0] if points else None for points in labels]
    assert len(points) == count
    return points, labels.skipped


def test_a_keyframe_has_the_persons_box_and_the_rest_the_trackers():
    points, skipped = label(Track(1, "a", (Keyframe(2, BOX),)), 5)
    assert points[:2] == [None, None]
    human, first, second = points[2:]
    assert (human.box, human.provenance, human.confidence) == (BOX, Provenance.HUMAN, 1.0)
    assert human.apce is None
    assert (first.box.x, second.box.x) == pytest.approx((11, 12))
    assert (first.provenance, first.apce, first.peak) == (Provenance.TRACKED, 40.0, 0.5)
    assert 0 < first.confidence < 1
    assert skipped == ()


def test_forward_alone_each_keyframe_starts_anew():
    points, _ = label(Track(1, "a", (Keyframe(0, BOX), Keyframe(3, OTHER))), 5, FORWARD)
    assert [point.box.x for point in points] == pytest.approx([10, 11, 12, 30, 31])
    assert [points[index].provenance for index in (0, 3)] == [Provenance.HUMAN] * 2


def test_passes_that_agree_are_cross_faded_and_meet_the_persons_boxes():
    end = BoundingBox(12, 20, 8, 9)
    points, _ = label(Track(1, "a", (Keyframe(0, BOX), Keyframe(4, end))), 5, tracker=Still)
    assert (points[0].box, points[4].box) == (BOX, end)
    assert [point.box.x for point in points] == pytest.approx([10, 10.5, 11, 11.5, 12])


def test_a_pass_that_meets_the_far_box_is_taken_before_one_that_does_not():
    """Both slide to the right, away from where the backward one should end."""
    end = BoundingBox(30, 20, 8, 9)
    points, _ = label(Track(1, "a", (Keyframe(0, BOX), Keyframe(20, end))), 21)
    assert [point.box.x for point in points[:16]] == pytest.approx(range(10, 26))


def test_outside_ends_the_track_until_the_next_box():
    track = Track(1, "a", (Keyframe(0, BOX), Keyframe(2, None), Keyframe(4, OTHER)))
    points, _ = label(track, 6)
    assert [point is not None for point in points] == [True, True, False, False, True, True]


def test_extended_tracks_go_back_from_their_first_keyframe():
    track = Track(1, "a", (Keyframe(3, BOX), Keyframe(5, OTHER)), extend=Extend.BOTH)
    points, _ = label(track, 6)
    assert [point.box.x for point in points[:4]] == pytest.approx([13, 12, 11, 10])
    points, _ = label(Track(1, "a", (Keyframe(3, BOX),)), 6, PropagationOptions(extend=Extend.BOTH))
    assert points[0] is not None


def test_occluded_holds_until_the_next_keyframe():
    track = Track(1, "a", (Keyframe(0, BOX), Keyframe(2, BOX, occluded=True), Keyframe(4, BOX)))
    points, _ = label(track, 6, FORWARD)
    hidden = State.OCCLUDED
    assert [point.state for point in points] == [
        State.VISIBLE, State.VISIBLE, hidden, hidden, State.VISIBLE, State.VISIBLE,
    ]  # fmt: skip


def test_what_is_hidden_from_one_box_to_the_next_is_bridged_and_not_tracked():
    track = Track(1, "a", (Keyframe(0, BOX, occluded=True), Keyframe(4, OTHER)))
    points, _ = label(track, 5)
    assert Sliding.starts == 1  # from the second box on
    assert [point.box.x + point.box.width / 2 for point in points] == pytest.approx(
        [14, 18.75, 23.5, 28.25, 33]
    )
    assert [point.state for point in points] == [State.OCCLUDED] * 4 + [State.VISIBLE]
    assert [point.provenance for point in points[1:4]] == [Provenance.INTERPOLATED] * 3


@pytest.mark.parametrize("method", [Method.LINEAR, Method.CUBIC, Method.HOLD])
def test_methods_without_a_tracker(method):
    track = Track(1, "a", (Keyframe(0, BOX), Keyframe(4, OTHER)), method=method)
    points, _ = label(track, 6)
    assert Sliding.starts == 0
    middle = {Method.LINEAR: 20, Method.CUBIC: 20, Method.HOLD: 10}[method]
    assert [points[index].box.x for index in (0, 2, 4, 5)] == pytest.approx([10, middle, 30, 30])
    assert points[2].provenance is Provenance.INTERPOLATED
    assert points[2].apce is None
    assert points[4].provenance is Provenance.HUMAN


def test_a_keyframe_outside_the_picture_or_past_the_end_is_skipped_and_named():
    beyond = BoundingBox(100, 100, 5, 5)
    track = Track(1, "a", (Keyframe(0, BOX), Keyframe(2, beyond), Keyframe(99, BOX)))
    points, skipped = label(track, 4)
    assert [skip.frame for skip in skipped] == [2, 99]
    assert "outside the picture of 60×50 pixels" in skipped[0].reason
    assert "the video's last frame is 3" in skipped[1].reason
    assert points == label(Track(1, "a", (Keyframe(0, BOX),)), 4)[0]


@pytest.mark.parametrize("box", [BoundingBox(-5, 0, 121, 5), BoundingBox(0, -90, 5, 101)])
def test_a_box_that_would_use_up_all_memory_is_not_tracked(box):
    track = Track(1, "a", (Keyframe(0, BOX), Keyframe(2, box)))
    points, skipped = label(track, 4)
    assert "is more than 2 times as wide or high as the picture of 60×50" in skipped[0].reason
    assert points == label(Track(1, "a", (Keyframe(0, BOX),)), 4)[0]
    still, skipped = label(replace(track, method=Method.HOLD), 4)
    assert (still[2].box, skipped) == (box, ())


@pytest.mark.parametrize("method", Method)
@pytest.mark.parametrize("size", [(0.0009, 5), (5, 1e-300)])
def test_a_box_without_area_is_skipped(method, size):
    track = Track(1, "a", (Keyframe(0, BOX), Keyframe(2, BoundingBox(10, 10, *size))))
    _, skipped = label(replace(track, method=method), 4)
    assert "is less than 0.001 pixels wide or high" in skipped[0].reason


def test_a_box_twice_as_large_as_the_picture_is_tracked():
    assert label(Track(1, "a", (Keyframe(0, BoundingBox(-5, -5, 120, 100)),)), 4)[1] == ()


def test_tracks_come_by_id_and_do_not_touch_each_other():
    tracks = [Track(7, "b", (Keyframe(1, OTHER),)), Track(2, "a", (Keyframe(0, BOX),))]
    labels = propagate(footage(4), tracks, tracker=Sliding)
    assert [[point.track_id for point in points] for points in labels] == [[2], *[[2, 7]] * 3]


def test_a_video_without_tracks_or_frames():
    assert list(propagate(footage(2), [], tracker=Sliding)) == [(), ()]


def test_one_keyframe_never_needs_the_video_backward():
    video = footage(6)
    propagate(video, [Track(1, "a", (Keyframe(1, BOX),))], tracker=Sliding)
    assert video.read == list(range(6))


def test_only_what_lies_between_keyframes_is_read_backward():
    video = footage(12)
    tracks = [
        Track(1, "a", (Keyframe(1, BOX), Keyframe(3, OTHER))),
        Track(2, "b", (Keyframe(6, BOX), Keyframe(8, OTHER), Keyframe(10, OTHER))),
    ]
    propagate(video, tracks, tracker=Sliding)
    assert video.read[12:] == [-10, -9, -8, -7, -6, -3, -2, -1]


def test_a_correction_changes_its_two_spans_only():
    before = (Keyframe(0, BOX), Keyframe(10, OTHER), Keyframe(20, BOX), Keyframe(29, OTHER))
    corrected = (*before[:2], Keyframe(15, BOX), *before[2:])
    cache = {}
    first, _ = label(Track(1, "a", before), 30, cache=cache)
    Sliding.starts = 0
    second, _ = label(Track(1, "a", corrected), 30, cache=cache)
    assert Sliding.starts == 4  # forward and backward in both new spans
    same = [one == other for one, other in zip(first, second, strict=True)]
    assert [frame for frame, equal in enumerate(same) if not equal] == list(range(11, 20))


def test_with_a_survey_and_all_passes_nothing_is_read():
    cache, surveys, track = {}, [], Track(1, "a", (Keyframe(0, BOX), Keyframe(5, OTHER)))
    first = propagate(footage(6), [track], tracker=Sliding, cache=cache, on_survey=surveys.append)
    video = footage(6)
    second = propagate(video, [track], tracker=Sliding, cache=cache, survey=surveys[0])
    assert video.read == []
    assert list(first) == list(second)


@pytest.mark.parametrize("threads", [2, 5])
def test_threads_change_nothing(threads):
    tracks = [
        Track(number, "a", (Keyframe(number, BOX), Keyframe(20, OTHER))) for number in range(1, 6)
    ]
    alone = list(propagate(footage(25), tracks, tracker=Sliding))
    assert list(propagate(footage(25), tracks, tracker=Sliding, threads=threads)) == alone
