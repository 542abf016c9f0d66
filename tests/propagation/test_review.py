"""Confidence from evidence, and what to review first."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from support.sliding import BOX, OTHER, Sliding, footage

from situp_annotate.propagation import PropagationOptions, Reason, propagate, suggest
from situp_annotate.propagation.confidence import (
    PRECISE,
    Evidence,
    Kind,
    design_matrix,
    feature_names,
    probability,
)
from situp_annotate.types import BoundingBox, Keyframe, Method, Track

SIZE_HW = (50, 60)


def evidence(kind, count=1, **known):
    """Evidence of boxes of one kind: nothing but what is given."""
    numbers = dict.fromkeys(("peak", "weakest", "agreement", "met", "distance", "drift"), 0.0)
    arrays = {name: np.full(count, value, float) for name, value in (numbers | known).items()}
    return Evidence(kind=np.full(count, list(Kind).index(kind)), **arrays)


def test_every_feature_has_a_name():
    assert design_matrix(evidence(Kind.OPEN, 3)).shape == (3, len(feature_names()))


@pytest.mark.parametrize("overlap", [0.5, PRECISE])
def test_a_higher_peak_and_less_drift_are_trusted_more(overlap):
    def chance(**known):
        return probability(evidence(Kind.AGREED, agreement=0.8, **known), overlap)[0]

    assert chance(peak=0.2) < chance(peak=0.4) < chance(peak=0.6)
    assert chance(peak=0.4, drift=0.5) < chance(peak=0.4)


def test_passes_that_disagree_are_trusted_less():
    near, far = (
        probability(evidence(Kind.AGREED, peak=0.4, agreement=value))[0] for value in (0.9, 0.4)
    )
    assert far < near


def test_a_lost_target_is_not_trusted():
    assert probability(evidence(Kind.LOST))[0] < 0.05


def test_to_be_precise_is_less_likely_than_to_be_good():
    some = evidence(Kind.ONE_PASS, peak=0.45, met=0.5)
    assert probability(some, PRECISE)[0] < probability(some)[0]


class Doubtful(Sliding):
    """Has low peaks."""

    def update(self, image, shift_xy=(0.0, 0.0)):
        return replace(super().update(image, shift_xy), peak=0.3)


def labels_of(keyframes, count=40, **options):
    track = Track(3, "a", tuple(Keyframe(frame, box) for frame, box in keyframes))
    options = PropagationOptions(**options)
    return propagate(footage(count, SIZE_HW), [track], options, tracker=Doubtful).tracks[0]


def test_suggestions_are_ranked_spread_and_never_a_persons_frame():
    labels = labels_of([(0, BOX), (39, OTHER)], method=Method.LINEAR)
    found = suggest(labels, SIZE_HW)
    assert found
    assert [each.gain for each in found] == sorted((each.gain for each in found), reverse=True)
    frames = sorted(each.frame for each in found)
    assert not {0, 39} & set(frames)
    assert all(later - earlier >= 3 for earlier, later in pairwise(frames))
    assert all(each.track_id == 3 for each in found)


def test_no_more_than_asked_for():
    labels = labels_of([(0, BOX), (39, OTHER)], method=Method.LINEAR)
    assert suggest(labels, SIZE_HW, most=1) == suggest(labels, SIZE_HW)[:1]


def test_where_everything_is_drawn_nothing_is_suggested():
    assert suggest(labels_of([(0, BOX), (1, BOX)], count=2), SIZE_HW) == ()


def test_a_box_over_the_border_is_said_to_be_near_it():
    edge = BoundingBox(-3, 20, 8, 9)
    labels = labels_of([(0, edge), (39, edge)], method=Method.HOLD)
    assert suggest(labels, SIZE_HW)[0].reason is Reason.BORDER


def test_passes_that_end_far_apart_are_said_to_disagree():
    labels = labels_of([(0, BOX), (39, BoundingBox(10, 40, 8, 9))])
    assert Reason.DISAGREE in {each.reason for each in suggest(labels, SIZE_HW)}
