"""Doubtful stretches: which frames they are, and when they are shown."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from situp_annotate.formats.overlay.options import OverlayOptions
from situp_annotate.formats.overlay.stretches import Excerpt, doubtful_stretches
from situp_annotate.types import (
    BoundingBox,
    Frame,
    Keyframe,
    Provenance,
    State,
    Track,
    TrackPoint,
    VideoInfo,
)

BOX = BoundingBox(0, 0, 5, 5)
TRACKS = [Track(number, "car", (Keyframe(0, BOX),)) for number in (1, 2)]
INFO = VideoInfo(Path("a.mp4"), "opencv", 64, 48, Fraction(10))


def stretches(confidences, *, other=1.0, **options):
    """Of a video in which track 1 has these confidences."""
    labels = [
        [TrackPoint(n, BOX, value, State.VISIBLE, Provenance.TRACKED) for n, value in pairs]
        for pairs in ([(1, confidence), (2, other)] for confidence in confidences)
    ]
    found = doubtful_stretches(labels, TRACKS, INFO, OverlayOptions(**options))
    return None if found is None else [(each.start, each.stop) for each in found]


def test_by_default_everything_is_shown():
    assert stretches([0.1] * 5) is None


def test_doubtful_frames_come_with_what_is_around_them():
    sure = [0.9] * 50
    sure[20:23] = [0.4, 0.3, 0.4]
    assert stretches(sure, below=0.5, context=0.5) == [(15, 28)]
    assert stretches(sure, below=0.5, context=0.0) == [(20, 23)]
    assert stretches(sure, below=0.35, context=0.0) == [(21, 22)]
    assert stretches(sure, below=0.3, context=0.0) == []


def test_stretches_that_meet_are_joined():
    sure = [0.9] * 40
    sure[10] = sure[15] = sure[30] = 0.1
    assert stretches(sure, below=0.5, context=0.2) == [(8, 18), (28, 33)]
    assert stretches(sure, below=0.5, context=0.1) == [(9, 12), (14, 17), (29, 32)]


def test_they_end_with_the_video():
    assert stretches([0.1, 0.9, 0.9, 0.1], below=0.5, context=1.0) == [(0, 4)]


def test_tracks_that_are_not_shown_do_not_count():
    assert stretches([0.9] * 5, other=0.1, below=0.5, tracks=(1,)) == []
    assert stretches([0.9] * 5, other=0.1, below=0.5, tracks=("car",)) == [(0, 5)]


def test_an_excerpt_has_no_gaps():
    excerpt = Excerpt([range(2, 4), range(7, 9)], INFO)
    picture = np.empty((0, 0), np.uint8)
    times = [excerpt.time_of(Frame(index, index * 100, picture)) for index in range(10)]
    step = 100_000_000
    assert times == [None, None, 0, 100, None, None, None, 100 + step, 200 + step, None]


@pytest.mark.parametrize("start", [0, 3])
def test_an_excerpt_begins_at_zero(start):
    excerpt = Excerpt([range(start, 9)], INFO)
    frame = Frame(start, 123_456, np.empty((0, 0), np.uint8))
    assert excerpt.time_of(frame) == 0
