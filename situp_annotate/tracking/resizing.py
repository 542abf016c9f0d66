"""Bicubic resizing with antialiasing, as MATLAB's ``imresize`` does it.

Notes
-----
No library at hand gives these pixels: OpenCV and SciPy do not antialias bicubic, and Pillow
rounds its weights. Cubic kernel with a = −0.5 (Keys 1981), stretched by the shrink factor,
weights normalised, borders mirrored, rounded half-up to uint8 after each of the two passes, the
axis that shrinks more first.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit

from situp_annotate.types import Image

__all__ = ["Resizer"]


def _cubic(x: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    x = np.abs(x)
    near = (1.5 * x - 2.5) * x * x + 1
    far = ((-0.5 * x + 2.5) * x - 4) * x + 2
    return np.where(x <= 1, near, np.where(x <= 2, far, 0.0))


def _taps(size_in: int, size_out: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Which inputs each output is made of: indices and weights, both (size_out, taps)."""
    scale = size_out / size_in
    stretch = min(scale, 1.0)
    reach = 4 / stretch
    # Centres of the outputs among the inputs, both counted from pixel centres at 0, 1, …
    centers = (np.arange(size_out) + 0.5) / scale - 0.5
    first = np.floor(centers - reach / 2).astype(np.int64)
    indices = first[:, np.newaxis] + np.arange(math.ceil(reach) + 2)
    weights = _cubic(stretch * (centers[:, np.newaxis] - indices))
    weights /= weights.sum(axis=1, keepdims=True)
    mirror = np.concatenate([np.arange(size_in), np.arange(size_in)[::-1]])
    used = (weights != 0).any(axis=0)
    return (
        np.ascontiguousarray(mirror[indices % (2 * size_in)][:, used]),
        np.ascontiguousarray(weights[:, used]),
    )


@njit(cache=True, nogil=True)
def _resize_rows(images, indices, weights, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    count, _, columns, channels = images.shape
    total = np.empty(columns * channels, np.float64)
    for n in range(count):
        for i in range(indices.shape[0]):
            total[:] = 0.5
            for tap in range(indices.shape[1]):
                weight = weights[i, tap]
                row = images[n, indices[i, tap]]
                for j in range(columns):
                    for channel in range(channels):
                        total[j * channels + channel] += weight * row[j, channel]
            for j in range(columns):
                for channel in range(channels):
                    value = total[j * channels + channel]
                    out[n, i, j, channel] = int(min(max(value, 0.0), 255.0))


@njit(cache=True, nogil=True)
def _resize_columns(images, indices, weights, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    count, rows, _, channels = images.shape
    for n in range(count):
        for i in range(rows):
            for j in range(indices.shape[0]):
                for channel in range(channels):
                    value = 0.5
                    for tap in range(indices.shape[1]):
                        value += weights[j, tap] * images[n, i, indices[j, tap], channel]
                    out[n, i, j, channel] = int(min(max(value, 0.0), 255.0))


@dataclass(frozen=True, slots=True)
class _Axis:
    indices: npt.NDArray[np.int64]
    weights: npt.NDArray[np.float64]


class Resizer:
    """Resizes batches of pictures from one fixed size to another.

    Parameters
    ----------
    size_in_hw, size_out_hw : tuple of int
        Rows and columns before and after.
    """

    def __init__(self, size_in_hw: tuple[int, int], size_out_hw: tuple[int, int]) -> None:
        shrink_y, shrink_x = (
            size_out / size_in for size_in, size_out in zip(size_in_hw, size_out_hw, strict=True)
        )
        self._rows_first = shrink_y <= shrink_x
        self._rows = _Axis(*_taps(size_in_hw[0], size_out_hw[0]))
        self._columns = _Axis(*_taps(size_in_hw[1], size_out_hw[1]))

    def __call__(self, images: Image) -> Image:
        """Resize pictures of shape (n, rows, columns, channels), uint8."""
        passes = (self._resize_rows, self._resize_columns)
        for resize in passes if self._rows_first else reversed(passes):
            images = resize(images)
        return images

    def _resize_rows(self, images: Image) -> Image:
        count, _, columns, channels = images.shape
        out = np.empty((count, len(self._rows.indices), columns, channels), np.uint8)
        _resize_rows(images, self._rows.indices, self._rows.weights, out)
        return out

    def _resize_columns(self, images: Image) -> Image:
        count, rows, _, channels = images.shape
        out = np.empty((count, rows, len(self._columns.indices), channels), np.uint8)
        _resize_columns(images, self._columns.indices, self._columns.weights, out)
        return out
