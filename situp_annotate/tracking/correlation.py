"""The kernelised correlation filter with a linear kernel, §III-A and §III-B of the paper.

Names that end in ``_f`` are half spectra of real arrays: those of single maps are complex,
(rows, columns // 2 + 1); those of features have real and imaginary parts apart and channels last,
(rows, 2, columns // 2 + 1, channels), as :mod:`situp_annotate.tracking.fourier` gives them.
"""

import copy
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit
from scipy import fft

__all__ = ["CorrelationFilter", "Model", "correlate", "gaussian_labels", "respond"]

Real = npt.NDArray[np.float32]
Complex = npt.NDArray[np.complex64]


def gaussian_labels(grid_hw: tuple[int, int], sigma: float) -> Real:
    """Regression target y of equation (2): a Gaussian with its peak at [0, 0], wrapped around.

    Parameters
    ----------
    grid_hw : tuple of int
        Rows and columns of the feature grid.
    sigma : float
        Standard deviation in cells.
    """
    rows, columns = (
        np.minimum(np.arange(size), size - np.arange(size)).astype(np.float64) for size in grid_hw
    )
    squared = rows[:, np.newaxis] ** 2 + columns**2
    return np.exp(-0.5 / sigma**2 * squared).astype(np.float32)


@njit(cache=True, nogil=True, fastmath={"reassoc", "contract"})
def _inner_product(z_real, z_imaginary, x_real, x_imaginary):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    real = imaginary = np.float32(0)
    for channel in range(z_real.size):
        real += z_real[channel] * x_real[channel] + z_imaginary[channel] * x_imaginary[channel]
        imaginary += z_imaginary[channel] * x_real[channel]
        imaginary -= z_real[channel] * x_imaginary[channel]
    return real, imaginary


@njit(cache=True, nogil=True)
def correlate(z_f, x_f, scale, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Linear kernel correlation k̂ˣᶻ, equation (12), times a scale."""
    rows, _, half, _ = z_f.shape
    for i in range(rows):
        for j in range(half):
            real, imaginary = _inner_product(z_f[i, 0, j], z_f[i, 1, j], x_f[i, 0, j], x_f[i, 1, j])
            out[i, j] = scale * (real + np.complex64(1j) * imaginary)


class Model(NamedTuple):
    """What a filter has learnt.

    ``alpha_f`` are the dual coefficients, ``template_f`` the spectrum of the features, and
    ``scale`` is 1 / (rows · columns · channels).
    """

    alpha_f: Complex
    template_f: Real
    scale: np.float32


@njit(cache=True, nogil=True)
def respond(z_f, model, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Response of a window, equations (9) and (10), before the transform back.

    Parameters
    ----------
    z_f : ndarray of float32
        Spectrum of the features of the window to search.
    model : Model
        Of a filter for windows of this size.
    out : ndarray of float32
        (rows, 2, columns // 2 + 1), real and imaginary parts; overwritten.
    """
    kernel_f = np.empty_like(model.alpha_f)
    correlate(z_f, model.template_f, model.scale, kernel_f)
    rows, half = kernel_f.shape
    for i in range(rows):
        for j in range(half):
            response_f = model.alpha_f[i, j] * kernel_f[i, j]
            out[i, 0, j], out[i, 1, j] = response_f.real, response_f.imag


@njit(cache=True, nogil=True, fastmath={"contract"})
def _interpolate(old, new, rate):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    for i in range(old.size):
        old[i] += rate * (new[i] - old[i])


class CorrelationFilter:
    """The model of a target: a template and dual coefficients.

    Parameters
    ----------
    labels : ndarray of float32
        (rows, columns), the regression target.
    spectrum_shape : tuple of int
        (rows, 2, columns // 2 + 1, channels), of the features.
    elements : int
        Rows · columns · channels of the features. Kernels are divided by it, as in the authors'
        code; that makes λ independent of the template's size.
    regularization : float
        λ of equation (7).

    Attributes
    ----------
    model : Model
        What has been learnt so far; zeros at first.
    """

    def __init__(
        self,
        labels: Real,
        spectrum_shape: tuple[int, ...],
        elements: int,
        regularization: float,
    ) -> None:
        scale = np.float32(1 / elements)
        self._regularization = np.float32(regularization)
        self._labels_f: Complex = fft.rfft2(labels)
        self._kernel_f = np.empty_like(self._labels_f)
        self._untrained = True
        self.model = Model(
            np.zeros_like(self._labels_f), np.zeros(spectrum_shape, np.float32), scale
        )

    def copy(self) -> "CorrelationFilter":
        """A filter that has learnt the same and goes on learning by itself; scratch is shared."""
        twin = copy.copy(self)
        twin.model = Model(
            self.model.alpha_f.copy(), self.model.template_f.copy(), self.model.scale
        )
        return twin

    def learn(self, x_f: Real, rate: float) -> None:
        """Update the model, equations (7) and (11).

        Parameters
        ----------
        x_f : ndarray of float32
            Spectrum of the features of the training window.
        rate : float
            θ: how much of the new there is in the updated model. The first time it is all.
        """
        rate = 1.0 if self._untrained else rate
        self._untrained = False
        model = self.model
        correlate(x_f, x_f, model.scale, self._kernel_f)
        alpha_f = self._labels_f / (self._kernel_f.real + self._regularization)
        _interpolate(model.alpha_f.reshape(-1), alpha_f.reshape(-1), np.float32(rate))
        _interpolate(model.template_f.reshape(-1), x_f.reshape(-1), np.float32(rate))
