"""A correlation filter along scales, which finds the size of a target whose place is known.

References
----------
M. Danelljan et al., Accurate scale estimation for robust visual tracking, BMVC 2014 (DSST). Numbers
are those of the authors' published settings.
"""

import copy
import math

import numpy as np
import numpy.typing as npt
from numba import njit

from situp_annotate.tracking.hog import HOG_CHANNELS, fhog, orientation_table
from situp_annotate.tracking.sampling import sample_window
from situp_annotate.types import Image

__all__ = ["ScaleFilter"]

Real = npt.NDArray[np.float32]

_SCALES = 33
_STEP = 1.02
_SIGMA = math.sqrt(_SCALES) / 4
_LEARNING_RATE = 0.025
_REGULARIZATION = 0.01
_LARGEST_AREA = 512
_CELL = 4


@njit(cache=True, nogil=True)
def _sample_scales(picture, center_yx, steps_yx, orientations, weights, window, maps, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    for n in range(len(steps_yx)):
        sample_window(picture, center_yx, (steps_yx[n, 0], steps_yx[n, 1]), window)
        fhog(window, orientations, _CELL, weights, maps)
        out[n] = maps[:, :, :HOG_CHANNELS].copy().reshape(-1)


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
        self._labels_f = np.fft.fft(np.exp(-0.5 * (places / _SIGMA) ** 2))
        self._hann = np.hanning(_SCALES)[:, np.newaxis]
        rows, columns = (size // _CELL for size in self._model_hw)
        self._window = np.empty((self._model_hw[0], channels, self._model_hw[1]), np.uint8)
        self._weights = np.ones((rows, columns), np.float32)
        self._maps = np.zeros((columns, rows, HOG_CHANNELS + 1), np.float32)
        self._untrained = True
        self._numerator = np.zeros((_SCALES, rows * columns * HOG_CHANNELS), np.complex128)
        self._denominator = np.zeros(_SCALES)

    def copy(self) -> "ScaleFilter":
        """A filter that has learnt the same and goes on learning by itself."""
        return copy.deepcopy(self)

    def _spectrum(
        self, picture: Image, center_yx: tuple[float, float], size_hw: tuple[float, float]
    ) -> npt.NDArray[np.complex128]:
        """(scales, numbers): spectrum along scales of the features of patches of all sizes."""
        step_hw = np.array(size_hw) / self._model_hw
        features = np.empty((_SCALES, self._maps[:, :, :HOG_CHANNELS].size), np.float32)
        _sample_scales(
            picture, center_yx, self._factors[:, np.newaxis] * step_hw, orientation_table(),
            self._weights, self._window, self._maps, features,
        )  # fmt: skip
        spectrum: npt.NDArray[np.complex128] = np.fft.fft(self._hann * features, axis=0)
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
        numerator = self._labels_f[:, np.newaxis] * spectrum.conj()
        denominator = (np.abs(spectrum) ** 2).sum(axis=1)
        rate = 1.0 if self._untrained else _LEARNING_RATE
        self._untrained = False
        self._numerator += rate * (numerator - self._numerator)
        self._denominator += rate * (denominator - self._denominator)

    def find(
        self, picture: Image, center_yx: tuple[float, float], size_hw: tuple[float, float]
    ) -> float:
        """Factor by which a target at this place is larger; parameters are those of `learn`."""
        spectrum = self._spectrum(picture, center_yx, size_hw)
        shared = (self._numerator * spectrum).sum(axis=1)
        response = np.fft.ifft(shared / (self._denominator + _REGULARIZATION)).real
        return float(self._factors[int(np.argmax(response))])
