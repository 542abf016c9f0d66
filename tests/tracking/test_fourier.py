"""The transform against NumPy's, for every kind of length: prime, even, four times something."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from situp_annotate.tracking.fourier import invert, plan_transform, transform


def spectra(maps):
    """Half spectra, complex (rows, half, channels), of maps (columns, rows, channels)."""
    columns, rows, channels = maps.shape
    out = np.empty((rows, 2, columns // 2 + 1, channels), np.float32)
    transform(maps, plan_transform((rows, columns), channels), out)
    return out[:, 0] + 1j * out[:, 1]


def random_maps(rows, columns, channels=3, seed=0):
    return np.random.default_rng(seed).normal(size=(columns, rows, channels)).astype(np.float32)


@settings(max_examples=60, deadline=None)
@given(st.integers(2, 70), st.integers(2, 70), st.integers(1, 5))
def test_it_is_the_discrete_fourier_transform(rows, columns, channels):
    maps = random_maps(rows, columns, channels)
    expected = np.fft.rfft2(np.swapaxes(maps, 0, 1), axes=(0, 1))
    np.testing.assert_allclose(spectra(maps), expected, atol=2e-6 * np.abs(expected).max())


@settings(max_examples=40, deadline=None)
@given(st.integers(2, 60), st.integers(2, 60), st.integers(1, 4))
def test_and_back(rows, columns, channels):
    maps = random_maps(rows, columns, channels)
    plan = plan_transform((rows, columns), channels)
    x_f = np.empty((rows, 2, columns // 2 + 1, channels), np.float32)
    transform(maps, plan, x_f)
    back = np.empty((channels, rows, columns), np.float32)
    invert(x_f, plan, back)
    np.testing.assert_allclose(back, maps.T, atol=1e-5)


@pytest.mark.parametrize("grid_hw", [(220, 14), (14, 220), (61, 61)])
def test_large_and_prime_grids(grid_hw):
    maps = random_maps(*grid_hw, channels=42)
    expected = np.fft.rfft2(np.swapaxes(maps, 0, 1), axes=(0, 1))
    np.testing.assert_allclose(spectra(maps), expected, atol=2e-6 * np.abs(expected).max())
