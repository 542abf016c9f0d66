"""A correlation filter along scales, which finds the size of a target whose place is known.

References
----------
M. Danelljan et al., Accurate scale estimation for robust visual tracking, BMVC 2014 (DSST). Numbers
are those of the authors' published settings.
"""

import copy
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit
from scipy import fft

from situp_annotate.tracking.hog import HOG_CHANNELS, fhog, orientation_table
from situp_annotate.tracking.sampling import sample_window
from situp_annotate.types import Image

__all__ = ["ScaleFilter"]

Real = npt.NDArray[np.float32]
Complex = npt.NDArray[np.complex64]

_SCALES = 33
_STEP = 1.02
_SIGMA = math.sqrt(_SCALES) / 4
_LEARNING_RATE = 0.025
_REGULARIZATION = 0.01
_LARGEST_AREA = 512
_CELL = 4


class _Plan(NamedTuple):
    """How to get from a picture to features at all scales; ``window`` and ``maps`` are scratch."""

    orientations: npt.NDArray[np.uint8]
    weights: Real
    hann: Real
    window: Image
    maps: Real


@njit(cache=True, nogil=True)
def _sample_scales(picture, center_yx, steps_yx, plan, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Features of patches at all scales, weighted by a window along scales: (numbers, scales)."""
    for n in range(len(steps_yx)):
        sample_window(picture, center_yx, (steps_yx[n, 0], steps_yx[n, 1]), plan.window)
        fhog(plan.window, plan.orientations, _CELL, plan.weights, plan.maps)
        number = 0
        for cell in plan.maps.reshape(-1, plan.maps.shape[2]):
            for channel in range(HOG_CHANNELS):
                out[number, n] = plan.hann[n] * cell[channel]
                number += 1


class ScaleFilter:
    """Finds by which factor a target has grown.

    Parameters
    ----------
    size_hw : tuple of float
        The target's first size, in pixels of the picture that is searched.
    channels : int
        Of the picture: 1 or 3.
    """

    def __init__(self, size_hw: tuple[float, float], channels: int) -> None:
        shrink = min(1.0, math.sqrt(_LARGEST_AREA / (size_hw[0] * size_hw[1])))
        self._model_hw = tuple(max(math.floor(size * shrink), 2 * _CELL) for size in size_hw)
        places = np.arange(_SCALES) - _SCALES // 2
        self._factors = _STEP ** places.astype(np.float64)
        labels = np.exp(-0.5 * (places / _SIGMA) ** 2)
        self._labels_f: Complex = fft.rfft(labels.astype(np.float32))
        rows, columns = (size // _CELL for size in self._model_hw)
        self._plan = _Plan(
            orientation_table(),
            np.ones((rows, columns), np.float32),
            np.hanning(_SCALES).astype(np.float32),
            np.empty((self._model_hw[0], channels, self._model_hw[1]), np.uint8),
            np.empty((columns, rows, HOG_CHANNELS + 1), np.float32),
        )
        self._untrained = True
        half = len(self._labels_f)
        self._numerator = np.zeros((rows * columns * HOG_CHANNELS, half), np.complex64)
        self._denominator = np.zeros(half, np.float32)

    def copy(self) -> "ScaleFilter":
        """A filter that has learnt the same and goes on learning by itself."""
        return copy.deepcopy(self)

    def _spectrum(
        self, picture: Image, center_yx: tuple[float, float], size_hw: tuple[float, float]
    ) -> Complex:
        """(numbers, scales // 2 + 1): half spectrum along scales of all patches' features."""
        step_hw = np.array(size_hw) / self._model_hw
        steps_yx = self._factors[:, np.newaxis] * step_hw
        features = np.empty((len(self._numerator), _SCALES), np.float32)
        _sample_scales(picture, center_yx, steps_yx, self._plan, features)
        spectrum: Complex = fft.rfft(features, overwrite_x=True)
        return spectrum

    def learn(
        self, picture: Image, center_yx: tuple[float, float], size_hw: tuple[float, float]
    ) -> None:
        """Learn how a target looks at sizes around its own.

        Parameters
        ----------
        picture : Image
            (height, width, channels), from :meth:`SearchWindow.prepare`.
        center_yx : tuple of float
            Centre of the target, as array indices.
        size_hw : tuple of float
            Its size in pixels of that picture.
        """
        spectrum = self._spectrum(picture, center_yx, size_hw)
        numerator = self._labels_f * spectrum.conj()
        denominator = np.einsum("ns,ns->s", spectrum, spectrum.conj()).real
        rate = np.float32(1.0 if self._untrained else _LEARNING_RATE)
        self._untrained = False
        self._numerator += rate * (numerator - self._numerator)
        self._denominator += rate * (denominator - self._denominator)

    def find(
        self, picture: Image, center_yx: tuple[float, float], size_hw: tuple[float, float]
    ) -> float:
        """Factor by which a target at this place is larger; parameters are those of `learn`."""
        spectrum = self._spectrum(picture, center_yx, size_hw)
        shared = np.einsum("ns,ns->s", self._numerator, spectrum)
        response = fft.irfft(shared / (self._denominator + _REGULARIZATION), _SCALES)
        return float(self._factors[int(np.argmax(response))])
