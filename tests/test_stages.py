"""How much there is to walk through, and how it is told."""

from support.patch import box_at, keyframe_at

from situp_annotate.propagation import PassKey, PropagationOptions
from situp_annotate.stages import FrameProgress, frames_to_walk
from situp_annotate.types import Extend, Keyframe, Method, Track

BOTH = PropagationOptions()


def track(number, *frames, **more):
    keyframes = tuple(keyframe_at(n) if n >= 0 else Keyframe(-n, None) for n in frames)
    return Track(number, "patch", keyframes, **more)


def count(*tracks, frames=100, options=BOTH, passes=(), surveyed=False):
    return frames_to_walk(tracks, options, frames, dict.fromkeys(passes), surveyed=surveyed)


def test_a_walk_forward_and_what_lies_between_boxes_backward():
    assert count() == 100
    assert count(track(1, 5)) == 100
    assert count(track(1, 5, 14)) == 100 + 10
    assert count(track(1, 5, -10, 20)) == 100
    assert count(track(1, 5, 200)) == 100


def test_stretches_of_several_tracks_count_once():
    assert count(track(1, 0, 10), track(2, 5, 20), track(3, 6, 8)) == 100 + 21
    assert count(track(1, 0, 10), track(2, 30, 40)) == 100 + 22


def test_options_of_tracks_and_of_all():
    forward = PropagationOptions(direction="forward")
    extended = PropagationOptions(direction="forward", extend=Extend.BOTH)
    assert count(track(1, 5, 14), options=forward) == 100
    assert count(track(1, 5, 14), options=extended) == 100 + 6
    assert count(track(1, 5, 14, extend=Extend.BOTH)) == 100 + 15
    assert count(track(1, 5, 14, method=Method.LINEAR)) == 100


def test_what_is_known_is_not_walked_again():
    ahead = PassKey(5, box_at(5), 14, False)
    behind = PassKey(14, box_at(14), 5, False)
    rest = PassKey(14, box_at(14), None, True)
    tracks = track(1, 5, 14)
    assert count(tracks, passes=[behind]) == 100
    assert count(tracks, passes=[ahead, behind, rest], surveyed=True) == 0
    assert count(tracks, passes=[behind, rest], surveyed=True) == 15
    assert count(tracks, passes=[ahead, rest], surveyed=True) == 10


def test_a_header_may_promise_anything():
    assert count(track(1, 0, 10), frames=2**62) == 2**62 + 11


def test_progress_reaches_its_total_whatever_was_expected():
    for expected in (2, 3, 4, None):
        seen = []
        progress = FrameProgress(lambda *told, seen=seen: seen.append(told))
        progress.expect(expected)
        for _ in range(3):
            progress.step()
        progress.finish()
        assert [done for done, _ in seen][:3] == [1, 2, 3]
        assert seen[-1] == (3, 3)
        assert len(seen) == (3 if expected in (2, 3) else 4)
