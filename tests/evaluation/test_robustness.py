"""Where runs begin, compared with what the OTB toolkit's formulas give by hand."""

import numpy as np
import pytest

from situp_annotate.evaluation.robustness import shifted_boxes, temporal_starts


def test_twenty_starts_of_a_hundred_frames():
    starts = temporal_starts(np.ones((100, 4)))
    # floor(1 : 81/19 : 81) and 81, less one.
    assert starts[:6] == [0, 4, 8, 12, 17, 21]
    assert starts[-3:] == [72, 76, 80]
    assert len(starts) == 20


def test_absent_frames_are_no_starts():
    truth = np.ones((100, 4))
    truth[:10], truth[10, 0], truth[17] = np.nan, 0, np.nan
    starts = temporal_starts(truth)
    assert starts[0] == 11
    assert 17 not in starts
    assert starts[-1] == 80


@pytest.mark.parametrize(("frames", "starts"), [(19, [0]), (20, [0]), (22, [0, 1, 2])])
def test_short_sequences_have_fewer(frames, starts):
    assert temporal_starts(np.ones((frames, 4))) == starts


def test_no_target_no_start():
    assert temporal_starts(np.zeros((30, 4))) == []


def test_eight_shifts_and_four_scales():
    assert shifted_boxes((50, 40, 20, 30), (100, 200)) == [
        (48, 40, 20, 30),
        (52, 40, 20, 30),
        (50, 37, 20, 30),
        (50, 43, 20, 30),
        (48, 37, 22, 33),
        (50, 37, 22, 33),
        (48, 40, 22, 33),
        (50, 40, 22, 33),
        (52, 43, 16, 24),
        (51, 42, 18, 27),
        (49, 39, 22, 33),
        (48, 37, 24, 36),
    ]


def test_boxes_stay_in_the_picture():
    boxes = shifted_boxes((1, 1, 100, 80), (80, 100))
    assert all(x >= 1 and y >= 1 for x, y, _, _ in boxes)
    assert all(x + w - 1 <= 100 and y + h - 1 <= 80 for x, y, w, h in boxes)
    assert boxes[1] == (11, 1, 90, 80)


def test_something_remains_of_a_box_beyond_the_picture():
    assert all(w >= 1 and h >= 1 for _, _, w, h in shifted_boxes((-50, 500, 5, 5), (80, 100)))
