"""What a person changed in exported labels is told from what the run had found."""

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from situp_annotate.finished.corrections import correct
from situp_annotate.formats.keyframed import keyframes_of
from situp_annotate.formats.labelled import LabelledTrack, LabelledVideo
from situp_annotate.types import (
    BoundingBox,
    Extend,
    Keyframe,
    Method,
    Provenance,
    State,
    Track,
    TrackPoint,
    VideoInfo,
)

FRAMES = 60
INFO = VideoInfo(Path("clip.mp4"), "opencv", 320, 200, Fraction(25))


def box_at(frame):
    # A path that bends, so that thinning keeps keyframes of the run's own.
    x = 10.333 + 2.123 * frame if frame < 30 else 73 - 1.5 * (frame - 30)
    return BoundingBox(x, 50.777, 40, 30)


def point(track_id, frame, state=State.VISIBLE, provenance=Provenance.TRACKED):
    return TrackPoint(track_id, box_at(frame), 0.9, state, provenance)


def labelled(track, gone=(), hidden=(), lost=()):
    human = {keyframe.frame for keyframe in track.keyframes if keyframe.box}
    points = {}
    for frame in range(FRAMES):
        if frame in gone:
            continue
        state = (
            State.OCCLUDED if frame in hidden else State.LOST if frame in lost else State.VISIBLE
        )
        provenance = Provenance.HUMAN if frame in human else Provenance.TRACKED
        points[frame] = point(track.id, frame, state, provenance)
    return LabelledTrack(track, points)


def video(*tracks):
    times = {frame: frame * 40_000_000 for frame in range(FRAMES)}
    return LabelledVideo("clip", INFO, FRAMES, times, tracks)


def exported(track):
    """The track as a tool gives it back, rounded to hundredths of corners."""
    states = (State.VISIBLE, State.OCCLUDED)
    keyframes = keyframes_of(track, frame_count=FRAMES, iou=0.97, states=states, decimals=2)
    return Track(track.track.id, track.track.label, tuple(map(rounded, keyframes)))


def rounded(keyframe):
    if keyframe.box is None:
        return keyframe
    box = keyframe.box
    left, top, right, bottom = (round(v, 2) for v in (box.x, box.y, box.right, box.bottom))
    return replace(keyframe, box=BoundingBox(left, top, right - left, bottom - top))


DRAWN = Track(
    3,
    "car",
    (Keyframe(0, box_at(0)), Keyframe(59, box_at(59))),
    {"colour": "red"},
    Method.SITUP,
)


@pytest.fixture
def run():
    return labelled(DRAWN)


def test_thinning_leaves_keyframes_of_the_run_to_be_told_apart(run):
    assert len(exported(run).keyframes) > 2


def test_untouched_labels_give_back_what_was_drawn(run):
    result = correct([exported(run)], video(run))
    assert result.tracks == (DRAWN,)
    assert (result.changed, result.added, result.removed) == (0, 0, 0)


def test_a_moved_box_is_a_keyframe_and_nothing_else_is(run):
    sent = exported(run)
    moved = Keyframe(25, BoundingBox(100, 60, 42, 31))
    back = replace(sent, keyframes=tuple(sorted((*sent.keyframes, moved), key=lambda k: k.frame)))
    result = correct([back], video(run))
    (track,) = result.tracks
    assert track.keyframes == (DRAWN.keyframes[0], moved, DRAWN.keyframes[1])
    assert (track.method, track.attributes) == (Method.SITUP, {"colour": "red"})
    assert result.changed == 1


def test_a_drawn_box_that_was_moved_or_deleted(run):
    sent = exported(run)
    moved = Keyframe(0, BoundingBox(12, 50, 40, 30))
    back = replace(sent, keyframes=(moved, *sent.keyframes[1:-1]))
    (track,) = correct([back], video(run)).tracks
    assert track.keyframes == (moved, sent.keyframes[-2])  # what stands beside the deleted one


def without(track, *frames):
    return replace(track, keyframes=tuple(k for k in track.keyframes if k.frame not in frames))


def frames_of(track):
    return [keyframe.frame for keyframe in track.keyframes]


def test_a_track_whose_first_box_was_deleted_begins_where_it_still_does(run):
    sent = exported(run)
    assert frames_of(sent) == [0, 29, 30, 59]
    result = correct([without(sent, 0)], video(run))
    (track,) = result.tracks
    assert (track.id, frames_of(track), result.removed) == (3, [29, 59], 0)


def test_a_track_that_was_split_keeps_both_halves():
    drawn = replace(DRAWN, keyframes=DRAWN.keyframes[:1])
    run = labelled(drawn)
    sent = exported(run)
    halves = [
        Track(1, "car", (sent.keyframes[0], Keyframe(20, None))),
        Track(2, "car", sent.keyframes[1:]),
    ]
    result = correct(halves, video(run))
    assert sorted(frames_of(track)[0] for track in result.tracks) == [0, 29]
    assert (result.added, result.removed) == (1, 0)


def test_beside_a_deleted_keyframe_of_the_run_boxes_stay(run):
    sent = exported(run)
    result = correct([without(sent, 29, 30)], video(run))
    assert frames_of(result.tracks[0]) == [0, 59]  # were drawn; nothing else is left
    bent = replace(DRAWN, keyframes=DRAWN.keyframes[:1])
    run = labelled(bent)
    result = correct([without(exported(run), 29)], video(run))
    assert frames_of(result.tracks[0]) == [0]
    result = correct([without(exported(run), 29, 30)], video(run))
    assert (frames_of(result.tracks[0]), result.changed) == ([0, 59], 1)


def test_where_the_run_had_lost_it_and_a_person_says_that_it_stays():
    drawn = replace(DRAWN, keyframes=DRAWN.keyframes[:1])
    run = labelled(drawn, lost=range(40, FRAMES))
    sent = exported(run)
    (track,) = correct([without(sent, 40)], video(run)).tracks
    assert track.keyframes == (drawn.keyframes[0], sent.keyframes[-2])


def test_the_first_part_of_an_extended_track_can_be_deleted():
    drawn = replace(DRAWN, keyframes=(Keyframe(30, box_at(30)),), extend=Extend.BOTH)
    run = labelled(drawn)
    sent = exported(run)
    assert correct([sent], video(run)).tracks == (drawn,)
    (track,) = correct([without(sent, 0)], video(run)).tracks
    assert (frames_of(track), track.extend) == ([29, 30], Extend.FORWARD)


def test_what_hides_the_object_ends_where_it_is_seen_again():
    run = labelled(DRAWN, hidden=range(40, 55))
    sent = exported(run)
    hides = Keyframe(45, BoundingBox(30, 40, 40, 30), occluded=True)
    back = replace(sent, keyframes=tuple(sorted((*sent.keyframes, hides), key=lambda k: k.frame)))
    (track,) = correct([back], video(run)).tracks
    assert frames_of(track) == [0, 45, 55, 59]
    assert [keyframe.occluded for keyframe in track.keyframes] == [False, True, False, False]


@pytest.mark.parametrize("occluded", [True, False])
def test_what_a_person_said_ends_where_its_end_was_deleted(occluded):
    said = Keyframe(20, box_at(20), occluded=True) if occluded else Keyframe(20, None)
    again = Keyframe(40, box_at(40))
    drawn = replace(DRAWN, keyframes=(DRAWN.keyframes[0], said, again))
    away = range(20, 40)
    run = labelled(drawn, hidden=away if occluded else (), gone=() if occluded else away)
    back = without(exported(run), 40)
    (track,) = correct([back], video(run)).tracks
    after = track.keyframes[-1]
    assert (after.frame, after.occluded) == (59, False)
    assert after.box is not None


def test_boxes_outside_the_picture_may_be_missing_or_not():
    run = labelled(replace(DRAWN, keyframes=DRAWN.keyframes[:1]))
    far = {
        frame: replace(run.points[frame], box=BoundingBox(400, 9, 9, 9)) for frame in range(40, 60)
    }
    run = LabelledTrack(run.track, {**run.points, **far})
    assert correct([exported(run)], video(run)).tracks == (run.track,)
    left_out = LabelledTrack(run.track, {f: run.points[f] for f in range(40)})
    assert correct([exported(left_out)], video(run)).tracks == (run.track,)


def test_exported_guesses_are_no_corrections():
    drawn = replace(DRAWN, keyframes=DRAWN.keyframes[:1])
    run = labelled(drawn, lost=range(40, FRAMES))
    keyframes = keyframes_of(run, frame_count=FRAMES, iou=0.97, states=tuple(State), decimals=2)
    sent = Track(3, "car", tuple(map(rounded, keyframes)))
    assert sent.keyframes[-1].box is not None
    assert correct([sent], video(run)).tracks == (drawn,)


def test_tracks_may_come_back_with_other_ids_and_in_another_order():
    other = replace(DRAWN, id=8, keyframes=(Keyframe(5, box_at(5)),))
    runs = labelled(DRAWN), labelled(other, gone=range(5), lost=range(40, 60))
    back = [replace(exported(runs[1]), id=1), replace(exported(runs[0]), id=2)]
    assert correct(back, video(*runs)).tracks == (DRAWN, other)


def test_new_and_deleted_tracks(run):
    new = Track(3, "dog", (Keyframe(4, BoundingBox(200, 10, 20, 20)),))
    result = correct([new], video(run))
    (track,) = result.tracks
    assert (track.label, track.id, track.keyframes) == ("dog", 4, new.keyframes)
    assert (result.added, result.removed) == (1, 1)


def test_gaps_of_the_run_are_not_a_persons():
    track = replace(DRAWN, keyframes=DRAWN.keyframes[:1])
    run = labelled(track, lost=range(40, FRAMES))
    sent = exported(run)
    assert sent.keyframes[-1] == Keyframe(40, None)
    assert correct([sent], video(run)).tracks == (track,)


@pytest.mark.parametrize("gone_from", [45, 50])
def test_where_a_person_said_outside_it_stays_so(gone_from):
    track = replace(DRAWN, keyframes=(DRAWN.keyframes[0], Keyframe(50, None)))
    run = labelled(track, gone=range(50, FRAMES), lost=range(gone_from, 50))
    assert correct([exported(run)], video(run)).tracks == (track,)


def test_outside_said_anew_lasts_until_the_next_keyframe(run):
    sent = exported(run)
    after = sent.keyframes[1]
    assert 3 < after.frame < 59
    leaves = Keyframe(3, None)
    back = replace(sent, keyframes=(sent.keyframes[0], leaves, *sent.keyframes[1:]))
    (track,) = correct([back], video(run)).tracks
    assert track.keyframes == (DRAWN.keyframes[0], leaves, after, DRAWN.keyframes[1])


def test_hidden_said_anew_lasts_until_the_next_keyframe(run):
    sent = exported(run)
    after = sent.keyframes[1]
    hides = Keyframe(3, box_at(3), occluded=True)
    back = replace(sent, keyframes=(sent.keyframes[0], hides, *sent.keyframes[1:]))
    (track,) = correct([back], video(run)).tracks
    assert track.keyframes == (DRAWN.keyframes[0], hides, after, DRAWN.keyframes[1])


def test_hidden_labels_of_the_run_are_its_own():
    run = labelled(DRAWN, hidden=range(10, 20))
    sent = exported(run)
    assert any(keyframe.occluded for keyframe in sent.keyframes)
    assert correct([sent], video(run)).tracks == (DRAWN,)


def test_boxes_cut_at_the_border_are_the_same():
    drawn = replace(DRAWN, keyframes=(Keyframe(0, box_at(0)),))
    run = labelled(drawn)
    wide = replace(run.points[59], box=BoundingBox(-12, 50.777, 40, 30))
    run = LabelledTrack(drawn, {**run.points, 59: wide})
    sent = exported(run)
    cut = Keyframe(59, BoundingBox(0, 50.78, 28, 30))
    back = replace(sent, keyframes=(*sent.keyframes[:-1], cut))
    assert correct([back], video(run)).tracks == (drawn,)


def test_a_track_without_a_box_left_is_gone(run):
    back = replace(exported(run), keyframes=(Keyframe(0, None),))
    result = correct([back], video(run))
    assert (result.tracks, result.removed) == ((), 1)


def test_attributes_change_only_where_a_person_changed_them(run):
    track = replace(DRAWN, attributes={"doors": 4, "colour": "red", "taxi": True})
    run = labelled(track)
    back = replace(exported(run), attributes={"doors": "4", "colour": "blue", "taxi": "true"})
    (corrected,) = correct([back], video(run)).tracks
    assert corrected.attributes == {"doors": 4, "colour": "blue", "taxi": True}
