"""Thinned keyframes: interpolation gives the labels back, and what matters is kept."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.labelled import labelled_track, labelled_videos

from situp_annotate.formats.keyframed import keyframes_of
from situp_annotate.propagation.thinning import overlaps
from situp_annotate.types import BoundingBox, Keyframe, Provenance, State

VISIBLE = (State.VISIBLE, State.OCCLUDED)
BOX = BoundingBox(10, 20, 30, 40)


def moved(by):
    return BoundingBox(10 + by, 20, 30, 40)


def keyframes(track, *, frame_count=20, iou=0.9, states=VISIBLE, decimals=2, keep=()):
    return keyframes_of(
        track, frame_count=frame_count, iou=iou, states=states, decimals=decimals, keep=keep
    )


def test_a_steady_move_needs_its_ends_and_an_outside():
    track = labelled_track(1, {frame: moved(frame) for frame in range(3, 11)})
    assert keyframes(track) == (
        Keyframe(3, moved(3)),
        Keyframe(10, moved(10)),
        Keyframe(11, None),
    )


def test_labels_up_to_the_end_of_the_video_need_no_outside():
    track = labelled_track(1, dict.fromkeys(range(20), BOX))
    assert keyframes(track) == (Keyframe(0, BOX), Keyframe(19, BOX))


def test_no_label_no_keyframe():
    lost = {0: (BOX, State.LOST, Provenance.TRACKED)}
    assert keyframes(labelled_track(1, {})) == ()
    assert keyframes(labelled_track(1, lost)) == ()
    assert keyframes(labelled_track(1, lost), states=(State.LOST,)) == (
        Keyframe(0, BOX, occluded=True),
        Keyframe(1, None),
    )


def test_boxes_of_a_person_stay_though_interpolation_needs_none():
    points = {frame: moved(frame) for frame in range(10)}
    points[4] = (BoundingBox(14 + 1 / 3, 20, 30, 40), State.VISIBLE, Provenance.HUMAN)
    assert keyframes(labelled_track(1, points), frame_count=10) == (
        Keyframe(0, moved(0)),
        Keyframe(4, points[4][0]),
        Keyframe(9, moved(9)),
    )


def test_a_change_of_state_is_kept():
    points = dict.fromkeys(range(9), (BOX, State.VISIBLE, Provenance.TRACKED))
    for frame in (3, 4, 5):
        points[frame] = (BOX, State.OCCLUDED, Provenance.TRACKED)
    found = keyframes(labelled_track(1, points), frame_count=9)
    assert [(k.frame, k.occluded) for k in found] == [
        (0, False),
        (3, True),
        (6, False),
        (8, False),
    ]


def test_frames_to_keep_stay_where_they_have_a_label():
    track = labelled_track(1, {frame: moved(frame) for frame in range(3, 20)})
    found = keyframes(track, keep={0, 7, 8, 99})
    assert [keyframe.frame for keyframe in found] == [3, 7, 8, 19]


@pytest.mark.parametrize("gap", [1, 4])
def test_a_gap_begins_with_outside_and_ends_with_a_box(gap):
    frames = [*range(5), *range(5 + gap, 10 + gap)]
    found = keyframes(labelled_track(1, dict.fromkeys(frames, BOX)), frame_count=10 + gap)
    assert [(k.frame, k.box is None) for k in found] == [
        (0, False),
        (4, False),
        (5, True),
        (5 + gap, False),
        (9 + gap, False),
    ]


@given(labelled_videos(least_size=1), st.sampled_from([0.5, 0.9, 1.0]))
def test_interpolation_overlaps_every_label(video, iou):
    for track in video.tracks:
        found = keyframes(track, frame_count=video.frame_count, iou=iou, decimals=9)
        wanted = track.in_states(VISIBLE)
        if not wanted:
            assert found == ()
            continue
        boxes = {frame: point.box for frame, point in wanted.items()}
        given_boxes = {k.frame: k.box for k in found if k.box is not None}
        assert given_boxes.items() <= boxes.items()
        assert min(overlaps(boxes, given_boxes)) >= iou - 1e-9
        outside = {k.frame for k in found if k.box is None}
        ends = {frame + 1 for frame in boxes if frame + 1 not in boxes}
        assert outside == ends - {video.frame_count}
        assert [k.frame for k in found] == sorted({k.frame for k in found})
        held = {k.frame: k.occluded for k in found}
        hidden = {f for f, point in wanted.items() if point.state is not State.VISIBLE}
        for frame in wanted:  # a keyframe's flag holds up to the next
            assert held[max(f for f in held if f <= frame)] == (frame in hidden)
        human = {f for f, point in wanted.items() if point.provenance is Provenance.HUMAN}
        assert human <= given_boxes.keys()
