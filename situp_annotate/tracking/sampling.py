"""Cut the search window out of a picture and bring it to the template's size.

The window is stretched by an affine map, so that it may reach beyond the picture and have any
size; §III-C of the paper, "sampled and resized through bilinear interpolation".

Notes
-----
The paper leaves the sampling grid open. This is the one of the authors' code, including two
peculiarities that change where peaks fall and therefore belong to the method: rows and columns
are placed half a pixel apart, and the step along rows is the *product* of both axes' ratios.
"""

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from situp_annotate.types import Image

__all__ = ["as_channels", "sample_windows"]


def as_channels(image: Image) -> Image:
    """Give a picture its channel axis: (h, w) → (h, w, 1); (h, w, 3) stays."""
    return image if image.ndim == 3 else image[:, :, np.newaxis]


def _taps(center: float, step: float, count: int, offset: float) -> npt.NDArray[np.float64]:
    """Coordinates of ``count`` samples around ``center``, as array indices."""
    return center + step * (np.arange(1, count + 1, dtype=np.float64) - count / 2 + offset)


@njit(cache=True, nogil=True)
def _bilinear(image, rows, columns, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    height, width, channels = image.shape
    for i in range(rows.size):
        top = int(rows[i])  # toward zero: (−1, 0) extrapolates from the first two pixels
        below = rows[i] - top
        for j in range(columns.size):
            left = int(columns[j])
            right = columns[j] - left
            for channel in range(channels):
                value = 0.0
                for dy in range(2):
                    y = top + dy
                    if y < 0 or y >= height:
                        continue
                    weight_y = below if dy else 1.0 - below
                    for dx in range(2):
                        x = left + dx
                        if x < 0 or x >= width:
                            continue
                        weight_x = right if dx else 1.0 - right
                        value += weight_y * weight_x * image[y, x, channel]
                out[i, j, channel] = int(min(max(value + 0.5, 0.0), 255.0))


def sample_windows(
    image: Image,
    center_yx: tuple[float, float],
    size_hw: tuple[float, float],
    factors: tuple[float, ...],
    window_hw: tuple[int, int],
) -> Image:
    """Sample one window for each scale factor.

    Parameters
    ----------
    image : Image
        (height, width, channels), uint8.
    center_yx : tuple of float
        Centre of the target, as array indices.
    size_hw : tuple of float
        Search window at factor 1, in pixels of the picture.
    factors : tuple of float
        Scales t of the pool.
    window_hw : tuple of int
        Size of the template, to which each window is brought.

    Returns
    -------
    Image
        (factors, rows, columns, channels), uint8. What lies outside the picture is 0.
    """
    rows, columns = window_hw
    windows = np.empty((len(factors), rows, columns, image.shape[2]), np.uint8)
    for window, factor in zip(windows, factors, strict=True):
        step_x = math.floor(size_hw[1] * factor) / columns
        step_y = math.floor(size_hw[0] * factor) / rows * step_x
        _bilinear(
            image,
            _taps(center_yx[0], step_y, rows, 0.0),
            _taps(center_yx[1], step_x, columns, 0.5),
            window,
        )
    return windows
