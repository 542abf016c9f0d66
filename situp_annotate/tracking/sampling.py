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
from numba import njit

__all__ = ["sample_window", "sampling_steps"]


@njit(cache=True, nogil=True)
def _taps(center, step, offset, size, firsts, weights):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """First neighbour of each sampling point, from −1 to ``size``, and the weights of two.

    Coordinates are cut off toward zero, so that those in (−1, 0) extrapolate from the first two
    pixels. Neighbours −1, ``size`` and ``size`` + 1 stand for what lies outside.
    """
    for i in range(firsts.size):
        position = center + step * (i + 1 - firsts.size / 2 + offset)
        if position <= -2.0:
            position = -1.0
        first = int(min(position, float(size)))
        firsts[i] = first
        weights[0, i] = 1.0 - (position - first)
        weights[1, i] = position - first


@njit(cache=True, nogil=True)
def _blend(above, below, weight_above, weight_below, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    for x in range(above.size):
        out[x] = weight_above * np.float64(above[x]) + weight_below * np.float64(below[x])


@njit(cache=True, nogil=True)
def _pick_grey(values, firsts, weights, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Blend two neighbours each."""
    weights_left, weights_right, grey = weights[0], weights[1], out[0]
    for j in range(firsts.size):
        i = firsts[j]
        grey[j] = weights_left[j] * values[i] + weights_right[j] * values[i + np.uint32(1)]


@njit(cache=True, nogil=True)
def _pick_color(values, firsts, weights, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Blend two neighbours each, and part the channels, which lie side by side in ``values``."""
    weights_left, weights_right = weights[0], weights[1]
    blue, green, red = out[0], out[1], out[2]
    for j in range(firsts.size):
        i, left, right = firsts[j], weights_left[j], weights_right[j]
        blue[j] = left * values[i] + right * values[i + np.uint32(3)]
        green[j] = left * values[i + np.uint32(1)] + right * values[i + np.uint32(4)]
        red[j] = left * values[i + np.uint32(2)] + right * values[i + np.uint32(5)]


@njit(cache=True, nogil=True)
def _round(values, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    for i in range(values.size):
        out[i] = np.uint8(min(max(values[i] + 0.5, 0.0), 255.0))


def sampling_steps(
    size_hw: tuple[float, float],
    factors_hw: tuple[float, float],
    window_hw: tuple[int, int],
    *,
    plain: bool = False,
) -> tuple[float, float]:
    """Pixels of the picture between neighbouring samples, along rows and columns.

    Parameters
    ----------
    size_hw : tuple of float
        Search window at factor 1, in pixels of the picture.
    factors_hw : tuple of float
        Scale t of the pool, of height and of width.
    window_hw : tuple of int
        Size of the template, to which the window is brought.
    plain : bool
        Whether rows have a step of their own, not that of the authors' code.
    """
    step_x = math.floor(size_hw[1] * factors_hw[1]) / window_hw[1]
    step_y = math.floor(size_hw[0] * factors_hw[0]) / window_hw[0]
    return (step_y if plain else step_y * step_x), step_x


@njit(cache=True, nogil=True)
def sample_window(image, center_yx, steps_yx, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Sample a window.

    Parameters
    ----------
    image : Image
        (height, width, channels), uint8.
    center_yx : tuple of float
        Centre of the target, as array indices.
    steps_yx : tuple of float
        From :func:`sampling_steps`.
    out : Image
        (rows, channels, columns), uint8; overwritten. What lies outside the picture is 0.
    """
    height, width, channels = image.shape
    rows, _, columns = out.shape
    y, weights_y = np.empty(rows, np.int64), np.empty((2, rows), np.float64)
    x, weights_x = np.empty(columns, np.int64), np.empty((2, columns), np.float64)
    _taps(center_yx[0], steps_yx[0], 0.0, height, y, weights_y)
    _taps(center_yx[1], steps_yx[1], 0.5, width, x, weights_x)
    # A row of the picture between first and last, with what lies outside on either side.
    first = min(max(x[0], 0), width - 1)
    last = min(max(x[columns - 1] + 2, first + 1), width)
    blended = np.zeros((last - first + 4) * channels, np.float64)
    inside = blended[channels : (last - first + 1) * channels]
    places = ((x - first + 1) * channels).astype(np.uint32)
    picked = np.empty((channels, columns), np.float64)
    for i in range(rows):
        above, below = y[i], y[i] + 1
        _blend(
            image[min(max(above, 0), height - 1), first:last].reshape(-1),
            image[min(max(below, 0), height - 1), first:last].reshape(-1),
            weights_y[0, i] if 0 <= above < height else 0.0,
            weights_y[1, i] if 0 <= below < height else 0.0,
            inside,
        )
        if channels == 1:
            _pick_grey(blended, places, weights_x, picked)
        else:
            _pick_color(blended, places, weights_x, picked)
        _round(picked.reshape(-1), out[i].reshape(-1))
