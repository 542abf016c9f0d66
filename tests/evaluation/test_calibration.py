"""Figures of confidence, counted by hand."""

import math

import numpy as np
import pytest

from situp_annotate.evaluation.calibration import calibration


def test_a_small_case():
    found = calibration(np.array([0.9, 0.8, 0.3, 0.2]), np.array([0.8, 0.4, 0.5, 0.1]))
    assert found.auroc == 3 / 4  # of the pairs of right and wrong, only (0.3, 0.8) is upside down
    assert found.ece == pytest.approx((0.1 + 0.8 + 0.7 + 0.2) / 4)
    assert found.share == 1 / 2  # the tenth is one box, one of two that are wrong


def test_ties_count_by_halves():
    assert calibration(np.full(4, 0.5), np.array([1.0, 0.0, 1.0, 0.0])).auroc == 0.5


def test_within_a_bin_errors_cancel():
    confidence = np.array([0.5, 0.5, 1.0])
    assert calibration(confidence, np.array([1.0, 0.0, 1.0])).ece == pytest.approx(0)


def test_perfect_boxes_leave_nothing_to_tell():
    found = calibration(np.array([0.9, 1.0]), np.array([0.9, 1.0]))
    assert math.isnan(found.auroc)
    assert math.isnan(found.share)
