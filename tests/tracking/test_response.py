"""APCE and peaks of maps whose answer is known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from situp_annotate.tracking.response import apce, find_peak

sides = st.integers(2, 9)
maps = arrays(np.float64, st.tuples(sides, sides), elements=st.integers(-50, 50))


def test_apce_of_a_single_peak_is_the_number_of_cells():
    response = np.zeros((6, 8))
    response[2, 3] = 7.0
    assert apce(response) == pytest.approx(48)


def test_apce_of_a_constant_map_is_zero():
    assert apce(np.full((5, 5), 3.0)) == 0


@given(maps, st.floats(0.01, 100), st.floats(-100, 100))
def test_apce_does_not_see_gain_and_offset(response, gain, offset):
    assert apce(gain * response + offset) == pytest.approx(apce(response), rel=1e-6)


@given(maps, st.integers(0, 8), st.integers(0, 8))
def test_apce_does_not_see_rolling(response, down, right):
    assert apce(np.roll(response, (down, right), (0, 1))) == pytest.approx(apce(response))


@pytest.mark.parametrize(
    ("index", "offset"),
    [((0, 0), (0, 0)), ((2, 1), (2, 1)), ((5, 7), (-1, -1)), ((3, 4), (-3, -4))],
)
def test_offsets_wrap_at_half(index, offset):
    response = np.zeros((6, 8))
    response[index] = 1
    assert find_peak(response).offset_yx == offset


def test_of_equal_peaks_the_first_column_wins():
    response = np.zeros((4, 6))
    response[0, 1] = response[1, 0] = 2
    peak = find_peak(response)
    assert (peak.offset_yx, peak.value) == ((1, 0), 2)


@given(st.floats(-0.45, 0.45), st.floats(-0.45, 0.45))
def test_the_fine_peak_is_a_paraboloids_vertex(y, x):
    rows, columns = np.mgrid[-3:4, -4:5]
    response = np.roll(9 - (rows - y) ** 2 - 0.5 * (columns - x) ** 2, (-3, -4), (0, 1))
    assert find_peak(response).fine_yx == pytest.approx((y, x))


def test_a_flat_map_has_its_fine_peak_at_the_peak():
    assert find_peak(np.ones((4, 6))).fine_yx == (0, 0)
