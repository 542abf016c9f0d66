"""Where nobody knows whether an object is in the picture."""

from dataclasses import replace

import pytest
from support.labelled import labelled_track

from situp_annotate.formats.outside import unsettled_frames
from situp_annotate.types import BoundingBox, Keyframe, Provenance, State

BOX = BoundingBox(10, 20, 30, 40)
LOST = (BOX, State.LOST, Provenance.TRACKED)
SHOWN = (State.VISIBLE, State.OCCLUDED)


def labelled(points, *keyframes):
    track = labelled_track(1, points)
    return replace(track, track=replace(track.track, keyframes=keyframes))


DRAWN, BACK, GONE = Keyframe(2, BOX), Keyframe(6, BOX), Keyframe(4, None)


@pytest.mark.parametrize(
    ("track", "unsettled"),
    [
        (labelled({2: BOX, 3: BOX}, DRAWN, GONE), {0, 1}),
        (labelled({2: BOX, 3: LOST}, DRAWN, GONE), {0, 1, 3}),
        (labelled({2: BOX, 3: BOX, 6: BOX, 7: BOX}, DRAWN, GONE, BACK), {0, 1}),
        (labelled({0: BOX, 1: BOX, 2: BOX, 3: BOX}, DRAWN, GONE), set()),
        (labelled({2: BOX, 3: BOX}, DRAWN), {0, 1, 4, 5, 6, 7}),
        (labelled({}, DRAWN), set(range(8))),
    ],
)
def test_absence_is_what_a_person_said(track, unsettled):
    assert unsettled_frames(track, frame_count=8, states=SHOWN) == unsettled


def test_labels_that_are_exported_are_settled_in_every_state():
    track = labelled({2: BOX, 3: LOST}, DRAWN, GONE)
    assert unsettled_frames(track, frame_count=8, states=tuple(State)) == {0, 1}
