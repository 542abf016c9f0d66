"""Thinning: as few keyframes as trying all of them finds, and what holds of every result."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from situp_annotate.propagation.thinning import overlaps, thin
from situp_annotate.types import BoundingBox

ULPS = 1e-9
"""What overlaps may differ by since two ways of computing them round differently."""


def track_of(rows, first=0):
    return {first + place: BoundingBox(*map(float, row)) for place, row in enumerate(rows)}


def between(start, end, share):
    """Interpolate two boxes; written anew here, as are the overlaps, to be the measure."""
    numbers = ("x", "y", "width", "height")
    pairs = [(getattr(start, name), getattr(end, name)) for name in numbers]
    return BoundingBox(*(a + (b - a) * share for a, b in pairs))


def overlap(a, b):
    across = max(0.0, min(a.right, b.right) - max(a.x, b.x))
    down = max(0.0, min(a.bottom, b.bottom) - max(a.y, b.y))
    return across * down / (a.width * a.height + b.width * b.height - across * down)


def least_between(track, start, end):
    """Least overlap of the frames between two keyframes; infinite if there are none."""
    found = [np.inf]
    for frame in range(start + 1, end):
        box = between(track[start], track[end], (frame - start) / (end - start))
        found.append(overlap(box, track[frame]))
    return min(found)


def fewest_by_trying_all(track, iou, keep=()):
    first, last = min(track), max(track)
    least = {(i, j): least_between(track, i, j) for i, j in combinations(sorted(track), 2)}
    must = {first, last, *keep}
    free = [frame for frame in sorted(track) if frame not in must]
    for count in range(len(free) + 1):
        for chosen in combinations(free, count):
            frames = sorted(must.union(chosen))
            if all(least[pair] >= iou for pair in pairwise(frames)):
                return len(frames)
    raise AssertionError("all frames together are always enough")


def least_of_rows(rows, start, end):
    """The same as :func:`least_between` for an array (frames, 4), with all frames at once."""
    share = np.arange(1, end - start)[:, np.newaxis] / (end - start)
    given = rows[start] + (rows[end] - rows[start]) * share
    boxes = rows[start + 1 : end]
    corner = np.maximum(given[:, :2], boxes[:, :2])
    opposite = np.minimum(given[:, :2] + given[:, 2:], boxes[:, :2] + boxes[:, 2:])
    shared = np.prod(np.clip(opposite - corner, 0, None), axis=1)
    areas = np.prod(given[:, 2:], axis=1) + np.prod(boxes[:, 2:], axis=1)
    return np.min(shared / (areas - shared), initial=np.inf)


def fewest_by_shortest_path(rows, iou):
    costs = [0] + [len(rows)] * (len(rows) - 1)
    for end in range(1, len(rows)):
        for start in range(end):
            if costs[start] + 1 < costs[end] and least_of_rows(rows, start, end) >= iou:
                costs[end] = costs[start] + 1
    return costs[-1] + 1


STEP = st.integers(-6, 6).map(lambda eighths: eighths / 8)


@st.composite
def tracks(draw, most=9):
    """Short tracks that wander by so little that many keyframes can be done without."""
    steps = draw(st.lists(st.tuples(STEP, STEP, STEP, STEP), min_size=1, max_size=most))
    rows = np.cumsum([(40, 30, 24, 18), *steps], axis=0)
    return track_of(rows[1:], first=draw(st.integers(0, 3)))


BOUNDS = st.sampled_from([0.6, 0.8, 0.9, 0.97, 1.0])


@settings(deadline=None, max_examples=300)
@given(track=tracks(), iou=BOUNDS, data=st.data())
def test_no_other_choice_is_smaller(track, iou, data):
    keep = data.draw(st.sets(st.sampled_from(sorted(track)), max_size=2))
    count = len(thin(track, iou=iou, keep=keep))
    # Where an overlap is as good as the bound, either answer is right.
    assert fewest_by_trying_all(track, iou - ULPS, keep) <= count
    assert count <= fewest_by_trying_all(track, iou + ULPS, keep)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    ("step", "jitter"), [(0.0, 0.0), (0.0, 0.4), (0.05, 0.4), (0.3, 0.1), (0.3, 0.8), (2.0, 0.0)]
)
def test_no_other_path_is_shorter_on_tracks_of_several_blocks(seed, step, jitter):
    random = np.random.default_rng(seed)
    rows = np.cumsum(random.normal(0, step, (150, 4)), axis=0)
    rows += random.normal(0, jitter, rows.shape) + (50, 40, 60, 45)
    rows[:, 2:] = np.maximum(rows[:, 2:], 8)
    rows[75:, 0] += 30
    assert len(thin(track_of(rows))) == fewest_by_shortest_path(rows, 0.9)


@settings(deadline=None)
@given(track=tracks(40), iou=BOUNDS, data=st.data())
def test_every_box_is_overlapped_enough_and_keyframes_are_the_track_s_own(track, iou, data):
    keep = data.draw(st.sets(st.sampled_from(sorted(track))))
    gone = data.draw(st.sets(st.sampled_from(sorted(track)))) - keep
    track = {frame: box for frame, box in track.items() if frame not in gone}
    if not track:
        return
    kept = thin(track, iou=iou, keep=keep)
    assert list(kept) == sorted(kept)
    assert kept.items() <= track.items()
    assert keep <= kept.keys()
    assert {f for f in track if f - 1 not in track or f + 1 not in track} <= kept.keys()
    assert overlaps(track, kept).shape == (len(track),)
    assert overlaps(track, kept).min() >= iou - ULPS


@settings(deadline=None)
@given(track=tracks(40), iou=BOUNDS)
def test_the_bound_holds_in_spite_of_rounding(track, iou):
    small = {
        frame: BoundingBox(box.x / 9, box.y / 9, box.width / 9, box.height / 9)
        for frame, box in track.items()
    }
    kept = thin(small, iou=iou, rounding=0.05)
    frames = sorted(kept)
    for start, end in pairwise(frames):
        for frame in range(start + 1, end):
            box = between(small[start], small[end], (frame - start) / (end - start))
            rounded = (round(number, 1) for number in (box.x, box.y, box.width, box.height))
            assert overlap(BoundingBox(*rounded), small[frame]) >= iou - ULPS


@pytest.mark.parametrize("iou", [0.5, 0.9, 1.0])
@pytest.mark.parametrize("pace", [(0, 0, 0, 0), (1.7, -0.3, 0.01, 0.09)])
def test_a_straight_track_has_two_keyframes(iou, pace):
    track = track_of(np.array((5, 400, 20, 30)) + np.outer(np.arange(1000), pace))
    assert list(thin(track, iou=iou)) == [0, 999]


def test_a_bend_is_a_keyframe():
    frames = np.arange(201)
    x = np.where(frames < 120, 3 * frames, 360 - 2 * (frames - 120))
    track = track_of(np.stack([x, x / 2, 50 + 0 * x, 40 + 0 * x], axis=1))
    assert len(thin(track)) == 3
    # With less leeway, only the bend itself will do.
    assert list(thin(track, iou=0.999)) == [0, 120, 200]


def test_a_jump_takes_the_frames_on_its_two_sides():
    rows = np.tile((10, 10, 20, 20), (300, 1))
    rows[200:, 0] = 90
    assert list(thin(track_of(rows))) == [0, 199, 200, 299]


def test_a_track_in_which_nothing_overlaps_keeps_all_frames():
    rows = [(frame * frame * 50, 10, 20, 20) for frame in range(100)]
    assert list(thin(track_of(rows))) == list(range(100))


def test_going_as_far_as_possible_is_not_always_best():
    track = track_of([(x, 0, 20, 20) for x in (0, 0, 1, 0, 2, 1)])
    assert [end for end in range(1, 6) if least_between(track, 0, end) >= 0.9] == [1, 2, 3]
    assert least_between(track, 3, 5) < 0.9  # so this way would be 0, 3, 4, 5
    assert list(thin(track)) == [0, 2, 5]


def test_runs_are_thinned_each_for_itself():
    rows = np.tile((10, 10, 20, 20), (30, 1))
    track = {frame: box for frame, box in track_of(rows).items() if frame not in (10, 20, 22)}
    assert list(thin(track)) == [0, 9, 11, 19, 21, 23, 29]
    assert list(thin(track, keep=[11, 25])) == [0, 9, 11, 19, 21, 23, 25, 29]


def test_the_order_of_the_mapping_does_not_matter():
    rows = [(frame * frame / 5, 10, 20, 20) for frame in range(30)]
    track = track_of(rows)
    assert thin(dict(reversed(track.items()))) == thin(track)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_what_cannot_be_thinned(count):
    track = track_of([(10, 10, 20, 20)] * count)
    assert thin(track) == track


def test_overlaps_have_their_known_values():
    track = track_of([(0, 0, 10, 10), (0, 0, 10, 5), (20, 0, 10, 10), (0, 0, 10, 10)])
    kept = {0: track[0], 3: track[3]}
    assert overlaps(track, kept).tolist() == [1, 0.5, 0, 1]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"iou": 0}, "iou must be greater than 0 and at most 1, not 0"),
        ({"iou": 1.1}, "not 1.1"),
        ({"iou": float("nan")}, "not nan"),
        ({"rounding": -1}, "rounding must be 0 or more, not -1"),
        ({"keep": [2, 7]}, "Frame 7 is to be kept but has no box"),
    ],
)
def test_wrong_use(options, message):
    with pytest.raises(ValueError, match=message):
        thin(track_of([(1, 2, 3, 4)] * 3), **options)
