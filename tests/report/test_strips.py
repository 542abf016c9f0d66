"""What a strip shows of a track: never better than it is, and all of it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.reports import linear_labels, linear_track, with_states

from situp_annotate.report.strips import (
    STATES,
    Samples,
    figures_of,
    lowest_profile,
    profile,
    profile_path,
    samples_of,
    strip_of,
)
from situp_annotate.types import State


def samples(confidence, states=None):
    confidence = np.array(confidence, float)
    codes = np.where(np.isnan(confidence), 0, 1) if states is None else states
    nobody = np.zeros(len(confidence), bool)
    return Samples(confidence, np.array(codes, np.uint8), nobody, nobody)


def heights(path, width):
    """Read a path back: the height over each unit, None where it is not drawn."""
    found = [None] * width
    for part in path.replace("z", "").split("M")[1:]:
        start, _, rest = part.partition(" 100")
        place, height = int(start), 0
        for token in rest.replace("v", " v").replace("h", " h").split():
            if token[0] == "v":
                height -= int(token[1:])
            else:
                found[place : place + int(token[1:])] = [height] * int(token[1:])
                place += int(token[1:])
        assert height == 0
    return found


def test_every_frame_has_a_column_while_there_is_room():
    strip = strip_of(samples([0.5, 0.5, 0.8, np.nan, 0.2]), columns=10, most_runs=10)
    assert strip.percent == (50, 50, 80, -1, 20)
    assert strip.path == "M0 100v-50h2v-30h1v80zM4 100v-20h1v20z"
    assert [(run.first, run.last, run.lowest) for run in strip.runs] == [(0, 2, 0.5), (4, 4, 0.2)]


def test_a_dip_of_a_single_frame_is_not_lost_by_thinning():
    confidence = np.full(18_000, 0.9)
    confidence[12_345] = 0.1
    strip = strip_of(samples(confidence), columns=1000, most_runs=100)
    assert len(strip.percent) == 1000
    assert strip.percent[12_345 * 1000 // 18_000] == 10
    assert len(strip.path) < 60


def test_states_that_flicker_are_told_for_longer_parts_by_their_worst():
    states = np.tile([1, 1, 1, 2], 1000)
    states[3998] = 3
    strip = strip_of(samples(np.full(4000, 0.7), states), columns=1000, most_runs=50)
    assert len(strip.runs) <= 50
    assert {run.state for run in strip.runs} == {State.OCCLUDED, State.LOST}
    assert (strip.runs[0].first, strip.runs[-1].last) == (0, 3999)
    assert strip.runs[-1].state is State.LOST


def test_no_frames_and_no_boxes():
    for none in (samples([]), samples([np.nan] * 7)):
        strip = strip_of(none, columns=10, most_runs=10)
        assert (strip.path, strip.runs) == ("", ())
        assert figures_of(none).boxes == 0
        assert figures_of(none).mean_confidence is None


@given(
    st.lists(st.one_of(st.just(np.nan), st.floats(0, 1)), min_size=1, max_size=300),
    st.integers(1, 120),
)
def test_a_path_draws_the_lowest_confidence_of_each_part(confidence, columns):
    strip = strip_of(samples(confidence), columns=columns, most_runs=1000)
    drawn = heights(strip.path, len(strip.percent))
    assert [-1 if each is None else each for each in drawn] == list(strip.percent)
    count = len(confidence)
    for part, percent in enumerate(strip.percent):
        shares = len(strip.percent)
        values = confidence[part * count // shares : (part + 1) * count // shares]
        known = [value for value in values if not np.isnan(value)]
        assert percent == (round(100 * min(known)) if known else -1)


@given(st.lists(st.sampled_from(range(len(STATES))), min_size=1, max_size=200))
def test_runs_say_the_state_of_every_frame(codes):
    confidence = [np.nan if code == 0 else 0.5 for code in codes]
    runs = strip_of(samples(confidence, codes), columns=10, most_runs=1000).runs
    told = np.zeros(len(codes), int)
    for run in runs:
        told[run.first : run.last + 1] = run.code
    assert list(told) == codes


def test_samples_are_what_the_labels_say():
    labels = linear_labels([linear_track(1, [2, 8, 14], occluded=[8])], 20)
    (track,) = labels.tracks
    found = samples_of(track, 20)
    figures = figures_of(found)
    points = dict(track.points())
    assert figures.boxes == len(points)
    for frame in range(20):
        point = points.get(frame)
        assert STATES[found.states[frame]] is (point.state if point else None)
        if point:
            assert found.confidence[frame] == point.confidence
            assert found.drawn[frame] == (point.provenance == "human")
            assert found.tracked[frame] == (point.provenance == "tracked")
    assert figures.in_state[State.OCCLUDED] == 6
    propagated = [p.confidence for p in points.values() if p.provenance != "human"]
    assert figures.mean_confidence == pytest.approx(np.mean(propagated))
    assert figures.drawn == len(points) - len(propagated)
    assert figures.tracked == 0


def test_lost_frames_are_counted():
    labels = linear_labels([linear_track(1, [0, 9])], 10)
    (track,) = labels.tracks
    stretch, *rest = track.stretches
    lost = with_states(stretch, [State.VISIBLE] * 5 + [State.LOST] * 4 + [State.VISIBLE])
    samples = samples_of(replace(track, stretches=(lost, *rest)), 10)
    assert figures_of(samples).in_state[State.LOST] == 4


def test_profile_is_short_and_never_above_the_truth():
    labels = linear_labels([linear_track(1, [10, 390], occluded=[390])], 400)
    (track,) = labels.tracks
    word = profile(track, 400)
    assert len(word) == 40
    assert word[0] == "."
    confidence = samples_of(track, 400).confidence
    for part, tenths in enumerate(word[1:], start=1):
        lowest = np.nanmin(confidence[10 * part : 10 * part + 10])
        assert int(tenths) == min(int(10 * lowest), 9)


def test_lowest_profile_and_its_path():
    assert lowest_profile(["99.5", "8..."]) == "89.5"
    assert lowest_profile([]) == ""
    assert profile_path("9.04") == "M0 100v-100h1v100zM2 100v-10h1v-40h1v50z"
