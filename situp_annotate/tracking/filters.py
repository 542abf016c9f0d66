"""The filters of SITUP's relatives: Gaussian kernels, averaged fractions, limited support.

Spectra are as in :mod:`situp_annotate.tracking.correlation`. All are written for clarity; the
linear kernel, which SITUP needs, has its own fast path there.
"""

import copy

import numpy as np
import numpy.typing as npt
from scipy import fft

from situp_annotate.tracking.correlation import CorrelationFilter, Model, correlate
from situp_annotate.tracking.params import TrackerParams

__all__ = ["BackgroundAwareFilter", "Filter", "GaussianFilter", "RatioFilter", "make_filter"]

_FAINTEST = 1e-12

Real = npt.NDArray[np.float32]
Complex = npt.NDArray[np.complex64]


def _energy(x_f: Real, columns: int) -> float:
    """Sum of squares of features, by Parseval's theorem from their half spectra."""
    by_column = np.einsum("irjc,irjc->j", x_f, x_f, dtype=np.float64)
    by_column[1 : (columns + 1) // 2] *= 2  # of these columns the spectrum has the other half too
    return float(by_column.sum()) / (len(x_f) * columns)


class GaussianFilter:
    """Kernelised correlation filter with a Gaussian kernel, as of CSK, KCF and SAMF.

    Parameters
    ----------
    labels, spectrum_shape, elements, regularization
        As of `CorrelationFilter`.
    sigma : float
        Standard deviation of the kernel.

    References
    ----------
    J. F. Henriques et al., High-speed tracking with kernelized correlation filters, PAMI 2015.
    """

    def __init__(
        self,
        labels: Real,
        spectrum_shape: tuple[int, ...],
        elements: int,
        regularization: float,
        sigma: float,
    ) -> None:
        self._grid_hw = labels.shape
        self._labels_f: Complex = fft.rfft2(labels)
        self._elements = elements
        self._regularization = np.float32(regularization)
        self._sigma = sigma
        self._untrained = True
        self._alpha_f = np.zeros_like(self._labels_f)
        self._template_f = np.zeros(spectrum_shape, np.float32)

    def copy(self) -> "GaussianFilter":
        """A filter that has learnt the same and goes on learning by itself."""
        return copy.deepcopy(self)

    def _kernel_f(self, z_f: Real, x_f: Real) -> Complex:
        shared_f = np.empty_like(self._labels_f)
        correlate(z_f, x_f, np.float32(1), shared_f)
        shared = fft.irfft2(shared_f, s=self._grid_hw)
        columns = self._grid_hw[1]
        distance = _energy(z_f, columns) + _energy(x_f, columns) - 2 * shared
        kernel = np.exp(-np.maximum(distance, 0) / (self._elements * self._sigma**2))
        kernel_f: Complex = fft.rfft2(kernel.astype(np.float32))
        return kernel_f

    def learn(self, x_f: Real, rate: float) -> None:
        """Update the model with the spectrum of a window; the first time it is all of it."""
        alpha_f = self._labels_f / (self._kernel_f(x_f, x_f) + self._regularization)
        part = np.float32(1.0 if self._untrained else rate)
        self._untrained = False
        self._alpha_f += part * (alpha_f - self._alpha_f)
        self._template_f += part * (x_f - self._template_f)

    def respond(self, spectra: Real) -> Real:
        """Response maps (n, rows, columns) of windows with these spectra."""
        maps = [
            fft.irfft2(self._alpha_f * self._kernel_f(z_f, self._template_f), s=self._grid_hw)
            for z_f in spectra
        ]
        return np.array(maps, np.float32)


class RatioFilter:
    """Correlation filter whose numerator and denominator are averaged over frames.

    Parameters
    ----------
    labels, spectrum_shape
        As of `CorrelationFilter`.
    regularization : float
        λ, which is added to the denominator: not divided by the number of elements.

    References
    ----------
    D. S. Bolme et al., Visual object tracking using adaptive correlation filters, CVPR 2010; of
    many channels: M. Danelljan et al., Discriminative scale space tracking, PAMI 2017.
    """

    def __init__(
        self, labels: Real, spectrum_shape: tuple[int, ...], regularization: float
    ) -> None:
        self._grid_hw = labels.shape
        self._labels_f: Complex = fft.rfft2(labels)
        self._regularization = np.float32(regularization)
        self._untrained = True
        self._numerator = np.zeros(spectrum_shape, np.float32)
        self._denominator = np.zeros(self._labels_f.shape, np.float32)

    def copy(self) -> "RatioFilter":
        """A filter that has learnt the same and goes on learning by itself."""
        return copy.deepcopy(self)

    def learn(self, x_f: Real, rate: float) -> None:
        """Update the model with the spectrum of a window; the first time it is all of it."""
        real, imaginary = x_f[:, 0], x_f[:, 1]
        label_f = self._labels_f[:, :, np.newaxis]
        numerator = np.empty_like(x_f)  # the features' spectra times that of the labels, conjugated
        numerator[:, 0] = label_f.real * real + label_f.imag * imaginary
        numerator[:, 1] = label_f.real * imaginary - label_f.imag * real
        energy_f = np.empty_like(self._labels_f)
        correlate(x_f, x_f, np.float32(1), energy_f)
        part = np.float32(1.0 if self._untrained else rate)
        self._untrained = False
        self._numerator += part * (numerator - self._numerator)
        self._denominator += part * (energy_f.real - self._denominator)

    def respond(self, spectra: Real) -> Real:
        """Response maps (n, rows, columns) of windows with these spectra."""
        shared_f = np.empty((len(spectra), *self._labels_f.shape), np.complex64)
        for z_f, out in zip(spectra, shared_f, strict=True):
            correlate(z_f, self._numerator, np.float32(1), out)
        response_f = shared_f / (self._denominator + self._regularization)
        responses: Real = fft.irfft2(response_f, s=self._grid_hw)
        return responses


class BackgroundAwareFilter:
    """Correlation filter that is zero beyond the target and its surroundings.

    So it can learn from windows far larger than the target, in which the background has really
    shifted instead of wrapped around. The features are averaged over frames; the filter for their
    average is found by the alternating direction method of multipliers (ADMM).

    Parameters
    ----------
    labels, spectrum_shape
        As of `CorrelationFilter`.
    support_hw : tuple of float
        Height and width in cells, around the window's middle, beyond which the filter is zero.

    Attributes
    ----------
    model : Model
        For :func:`situp_annotate.tracking.correlation.respond`: the filter takes the template's
        place, and the coefficients are such that the average's response at its middle is 1. Zeros
        at first.

    References
    ----------
    H. Kiani Galoogahi et al., Learning background-aware correlation filters for visual tracking,
    ICCV 2017 (BACF). Two iterations and their penalties are those of the authors' published
    settings; their ridge term, which is far smaller, is left out.
    """

    _PENALTIES = (1.0, 10.0)

    def __init__(
        self, labels: Real, spectrum_shape: tuple[int, ...], support_hw: tuple[float, float]
    ) -> None:
        self._grid_hw = labels.shape
        self._labels_f: Complex = fft.rfft2(labels)
        self._support = np.outer(
            *(_inside(size, extent) for size, extent in zip(labels.shape, support_hw, strict=True))
        )[:, :, np.newaxis]
        self._average_f: Complex | None = None
        self.model = Model(
            np.zeros_like(self._labels_f), np.zeros(spectrum_shape, np.float32), np.float32(1)
        )

    def copy(self) -> "BackgroundAwareFilter":
        """A filter that has learnt the same and goes on learning by itself."""
        return copy.deepcopy(self)

    def learn(self, x_f: Real, rate: float) -> None:
        """Update the model with the spectrum of a window; the first time it is all of it."""
        new_f = x_f[:, 0] + np.complex64(1j) * x_f[:, 1]
        if self._average_f is None:
            self._average_f = new_f
        else:
            self._average_f += np.float32(rate) * (new_f - self._average_f)
        filter_f = self._solved(self._average_f)
        self.model.template_f[:, 0], self.model.template_f[:, 1] = filter_f.real, filter_f.imag
        learnt_f = np.einsum("ijk,ijk->ij", self._average_f, filter_f.conj())
        peak = fft.irfft2(learnt_f, s=self._grid_hw)[0, 0]
        self.model.alpha_f[:] = 1 / max(peak, _FAINTEST)  # blank windows have no peak at all

    def _solved(self, x_f: Complex) -> Complex:
        """Filter for features with this spectrum; both (rows, columns // 2 + 1, channels)."""
        wanted_f = x_f * self._labels_f[:, :, np.newaxis].conj()
        energy = (x_f.real**2 + x_f.imag**2).sum(axis=2, keepdims=True)
        filter_f = multiplier_f = np.zeros_like(x_f)
        for penalty in self._PENALTIES:
            weight = np.float32(penalty * self._support.size)
            target_f = wanted_f + weight * (filter_f - multiplier_f)
            # A matrix of rank one and a diagonal: Sherman and Morrison's formula inverts it.
            along_f = np.einsum("ijk,ijk->ij", x_f.conj(), target_f)[:, :, np.newaxis]
            free_f = (target_f - x_f * (along_f / (weight + energy))) / weight + multiplier_f
            free = fft.irfft2(free_f, s=self._grid_hw, axes=(0, 1))
            filter_f = fft.rfft2(free * self._support, axes=(0, 1))
            multiplier_f = free_f - filter_f
        return filter_f


def _inside(size: int, extent: float) -> Real:
    """Which of a window's cells are within an extent around its middle: 1 or 0."""
    middle = size / 2 - 0.6  # HOG's cells begin there where windows are sampled
    inside = np.abs(np.arange(size) - middle) <= max(extent / 2, 1)
    return np.where(inside, np.float32(1), np.float32(0))


Filter = CorrelationFilter | GaussianFilter | RatioFilter | BackgroundAwareFilter


def make_filter(
    labels: Real,
    spectrum_shape: tuple[int, ...],
    elements: int,
    target_hw: tuple[float, float],
    params: TrackerParams,
) -> Filter:
    """The filter that the parameters ask for; for the others see `CorrelationFilter`.

    ``target_hw`` is the target's size in cells.
    """
    match params.filter:
        case "ratio":
            return RatioFilter(labels, spectrum_shape, params.regularization)
        case "background":
            height, width = (params.support * size for size in target_hw)
            return BackgroundAwareFilter(labels, spectrum_shape, (height, width))
    if params.kernel == "gaussian":
        return GaussianFilter(
            labels, spectrum_shape, elements, params.regularization, params.kernel_sigma
        )
    return CorrelationFilter(labels, spectrum_shape, elements, params.regularization)
