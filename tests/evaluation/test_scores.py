"""Curves of boxes whose errors are known by construction."""

import numpy as np
import pytest

from situp_annotate.evaluation.metrics import evaluate_one_pass
from situp_annotate.evaluation.scores import mean_scores, pooled_scores


def shifted(*steps):
    """A 10 × 10 target that stays, and boxes that lie so many pixels beside it."""
    truth = np.tile([1.0, 1, 10, 10], (len(steps), 1))
    return evaluate_one_pass(truth + [[step, 0, 0, 0] for step in steps], truth)


def test_curves_of_two_frames():
    scores = pooled_scores([shifted(0, 5)])
    # Overlaps are 1 and 1/3: both above 0 to 0.3, one above 0.35 to 0.95, none above 1.
    assert scores.success_curve == (1.0,) * 7 + (0.5,) * 13 + (0.0,)
    assert scores.auc == pytest.approx((7 + 13 / 2) / 21)
    assert scores.precision_curve == (0.5,) * 5 + (1.0,) * 46
    # 5 pixels are half of the target's width: the last threshold.
    assert scores.normalized_curve == (0.5,) * 50 + (1.0,)
    assert scores.normalized_precision == pytest.approx((50 / 2 + 1) / 51)


def test_precision_is_the_share_up_to_twenty_pixels():
    assert pooled_scores([shifted(0, 20, 21, 50)]).precision == 0.5


def test_all_frames_of_all_runs_count_together():
    scores = pooled_scores([shifted(0, 30, 30), shifted(0)])
    assert scores.precision == 0.5
    assert scores.success_curve[0] == 0.5


def test_targets_have_the_same_weight_in_means():
    scores = mean_scores([pooled_scores([shifted(0, 30, 30, 30)]), pooled_scores([shifted(0)])])
    assert scores.precision == pytest.approx((0.25 + 1) / 2)
    assert scores.auc == pytest.approx((0.25 + 1) / 2 * 20 / 21)


def test_absent_truth_is_a_miss_in_success_and_a_hit_in_both_precisions():
    truth = np.array([[1.0, 1, 10, 10], [np.nan] * 4])
    scores = pooled_scores([evaluate_one_pass(np.tile([1.0, 1, 10, 10], (2, 1)), truth)])
    assert scores.success_curve[0] == 0.5
    assert scores.precision_curve[0] == 1
    assert scores.normalized_curve[0] == 1
