"""Bicubic resizing with antialiasing, as MATLAB's ``imresize`` does it.

Notes
-----
No library at hand gives these pixels: OpenCV and SciPy do not antialias bicubic, and Pillow
rounds its weights. Cubic kernel with a = −0.5 (Keys 1981), stretched by the shrink factor,
weights normalised, borders mirrored, rounded half-up to uint8 after each of the two passes, the
axis that shrinks more first.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from situp_annotate.types import Image

__all__ = ["Resizing", "halve", "plan_resizing", "resize"]

_HALF = np.float32(0.5)
_AT_ONCE = 4
"""Taps taken together; their number is filled up to a multiple of this."""


def _cubic(x: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    x = np.abs(x)
    near = (1.5 * x - 2.5) * x * x + 1
    far = ((-0.5 * x + 2.5) * x - 4) * x + 2
    return np.where(x <= 1, near, np.where(x <= 2, far, 0.0))


class _Taps(NamedTuple):
    """Which inputs each output is made of.

    The outputs' taps are consecutive places of the axis with mirrored ends: ``mirrored`` has the
    input at each of those places, ``firsts`` each output's first place, ``weights`` the weights
    of that place and the following ones, (outputs, taps).
    """

    mirrored: npt.NDArray[np.int64]
    firsts: npt.NDArray[np.int64]
    weights: npt.NDArray[np.float32]


def _taps(size_in: int, size_out: int, scale: float) -> _Taps:
    stretch = min(scale, 1.0)
    reach = 4 / stretch
    # Centres of the outputs among the inputs, both counted from pixel centres at 0, 1, …
    centers = (np.arange(size_out) + 0.5) / scale - 0.5
    firsts = np.floor(centers - reach / 2).astype(np.int64)
    offsets = np.arange(math.ceil(reach) + 2)
    weights = _cubic(stretch * (centers[:, np.newaxis] - firsts[:, np.newaxis] - offsets))
    weights /= weights.sum(axis=1, keepdims=True)
    used = np.flatnonzero((weights != 0).any(axis=0))
    firsts += used[0]
    weights = weights[:, used[0] : used[-1] + 1]
    weights = np.pad(weights, ((0, 0), (0, -weights.shape[1] % _AT_ONCE)))
    places = np.arange(firsts[0], firsts[-1] + weights.shape[1])
    both_ways = np.concatenate([np.arange(size_in), np.arange(size_in)[::-1]])
    return _Taps(
        both_ways[places % (2 * size_in)],
        firsts - firsts[0],
        np.ascontiguousarray(weights, np.float32),
    )


@njit(cache=True, nogil=True, fastmath={"contract"})
def _add_rows(a, b, c, d, weights, total):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    p, q, r, s = weights[0], weights[1], weights[2], weights[3]
    for x in range(total.size):
        total[x] += (
            p * np.float32(a[x]) + q * np.float32(b[x])
            + r * np.float32(c[x]) + s * np.float32(d[x])
        )  # fmt: skip


@njit(cache=True, nogil=True)
def _store(total, row):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    for x in range(total.size):
        row[x] = np.uint8(min(max(total[x], np.float32(0)), np.float32(255)))


@njit(cache=True, nogil=True)
def _resize_rows(picture, taps):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """(rows, lanes) → (fewer rows, lanes)."""
    out = np.empty((taps.firsts.size, picture.shape[1]), np.uint8)
    total = np.empty(picture.shape[1], np.float32)
    for i in range(taps.firsts.size):
        total[:] = _HALF
        for tap in range(0, taps.weights.shape[1], _AT_ONCE):
            place = taps.firsts[i] + tap
            _add_rows(
                picture[taps.mirrored[place]],
                picture[taps.mirrored[place + 1]],
                picture[taps.mirrored[place + 2]],
                picture[taps.mirrored[place + 3]],
                taps.weights[i, tap : tap + _AT_ONCE],
                total,
            )
        _store(total, out[i])
    return out


@njit(cache=True, nogil=True)
def _transpose(picture):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    rows, columns = picture.shape
    out = np.empty((columns, rows), np.uint8)
    for j in range(columns):
        line = out[j]
        for i in range(rows):
            line[i] = picture[i, j]
    return out


class Resizing(NamedTuple):
    """How to resize pictures from one fixed size to another."""

    rows: _Taps
    columns: _Taps
    rows_first: bool


def plan_resizing(size_in_hw: tuple[int, int], size_out_hw: tuple[int, int]) -> Resizing:
    """Plan to resize pictures; sizes are rows and columns before and after."""
    shrink_y, shrink_x = (
        size_out / size_in for size_in, size_out in zip(size_in_hw, size_out_hw, strict=True)
    )
    return Resizing(
        _taps(size_in_hw[0], size_out_hw[0], shrink_y),
        _taps(size_in_hw[1], size_out_hw[1], shrink_x),
        shrink_y <= shrink_x,
    )


@njit(cache=True, nogil=True)
def resize(picture, plan):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Resize a picture (rows, channels, columns), uint8, to (columns, rows, channels).

    Both passes work along rows, on whole rows of numbers at a time, with transposed copies
    between them: that is several times as fast as working along columns.
    """
    rows, columns = plan.rows, plan.columns
    height, channels, width = picture.shape
    if plan.rows_first:
        low = _resize_rows(picture.reshape((height, channels * width)), rows)
        small = _resize_rows(_transpose(low.reshape((-1, width))), columns)
    else:
        narrow = _resize_rows(_transpose(picture.reshape((-1, width))), columns)
        low = _resize_rows(_transpose(narrow).reshape((height, -1)), rows)
        small = _transpose(low.reshape((-1, columns.firsts.size)))
    return small.reshape((columns.firsts.size, rows.firsts.size, channels))


_HALVING = _taps(16, 8, 0.5).weights[4]


@njit(cache=True, nogil=True)
def _mirror(index, size):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    index %= 2 * size
    return min(index, 2 * size - 1 - index)


@njit(cache=True, nogil=True)
def _halve(image, span, weights, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    height, width, channels = image.shape
    top, bottom, left, right = span
    # Output j has taps 2j − 3 … 2j + 4. Those at even places stand side by side in one row of
    # numbers, those at odd places in another.
    lanes = (right - left) * channels
    places = np.empty((2, lanes + 3 * channels), np.uint32)
    for i in range(places.shape[1]):
        x = 2 * (left + i // channels) - 3
        places[0, i] = _mirror(x, width) * channels + i % channels
        places[1, i] = _mirror(x + 1, width) * channels + i % channels
    line_total, total = np.empty(width * channels, np.float32), np.empty(lanes, np.float32)
    line, every_other = np.empty(width * channels, np.uint8), np.empty(places.shape, np.uint8)
    first = max(2 * left - 4, 0) * channels
    last = min(2 * right + 4, width) * channels
    even_weights, odd_weights = weights[::2].copy(), weights[1::2].copy()
    for i in range(top, bottom):
        line_total[:] = _HALF
        for tap in range(0, weights.size, _AT_ONCE):
            y = 2 * i - 3 + tap
            _add_rows(
                image[_mirror(y, height)].reshape(-1)[first:last],
                image[_mirror(y + 1, height)].reshape(-1)[first:last],
                image[_mirror(y + 2, height)].reshape(-1)[first:last],
                image[_mirror(y + 3, height)].reshape(-1)[first:last],
                weights[tap : tap + _AT_ONCE],
                line_total[first:last],
            )
        _store(line_total[first:last], line[first:last])
        total[:] = _HALF
        for parity in range(2):
            part = every_other[parity]
            for place in range(part.size):
                part[place] = line[places[parity, place]]
            _add_rows(
                part,
                part[channels:],
                part[2 * channels :],
                part[3 * channels :],
                odd_weights if parity else even_weights,
                total,
            )
        _store(total, out[i].reshape(-1)[left * channels : right * channels])


def halve(image: Image, span: tuple[int, int, int, int], out: Image) -> None:
    """Compute a part of a picture at half size.

    Parameters
    ----------
    image : Image
        (height, width, channels), uint8.
    span : tuple of int
        First row and the one after the last, first column and the one after the last, of the
        part of the half-size picture.
    out : Image
        (⌈height / 2⌉, ⌈width / 2⌉, channels), uint8: the half-size picture, of which that part
        is overwritten.
    """
    _halve(image, span, _HALVING, out)
