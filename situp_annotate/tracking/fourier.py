"""The two-dimensional Fourier transform of stacks of small real maps.

Feature grids have some ten to sixty cells a side, any number of them, often a prime, and dozens
of channels. There a transform as a matrix product, with symmetries folded in, is some twice as fast
as a general FFT, because it works on thousands of neighbouring numbers at a time;
``benchmarks/transform.py`` measures it.

Notes
-----
With θ = 2π/N, the transform of z is Σᵣ z[r] cos(θqr) − i Σᵣ z[r] sin(θqr). Cosines are even and
sines odd in r, so that z[r] ± z[N−r] need only half of the products. If N is even, both are even
or odd about N/4 too, depending on whether q is even or odd, which halves them once more. Folding
(sums of up to four inputs with signs) leaves up to four small real matrices.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

__all__ = ["TransformPlan", "invert", "plan_transform", "transform"]

Real = npt.NDArray[np.float32]
Index = npt.NDArray[np.int64]

_UNROLLED = 4
_GROUPS_OF_ODD = 2
_BLOCK_BYTES = 256 * 1024


class _Axis(NamedTuple):
    """How to transform along an axis of N inputs.

    ``sources`` and ``signs``, both (groups · height, 4), make the folded rows; group g's begin
    at g · height. ``matrices`` (groups, height, height) are filled up with zeros, ``extents``
    (groups, 2) say how far they matter. Output q's cosine sum is row ``cosines[q]`` of the
    products, its sine sum row ``sines[q]`` times ``sine_signs[q]``.
    """

    sources: Index
    signs: Real
    matrices: Real
    extents: Index
    cosines: Index
    sines: Index
    sine_signs: Real


def _folded_inputs(size: int, r: int, mirror_sign: int, middle_sign: int) -> dict[int, int]:
    """Inputs that input r stands for, with signs: r, N − r, and with them about N/4 if asked."""
    folded: dict[int, int] = {}
    for source, sign in (
        (r, 1),
        (-r, mirror_sign),
        (size // 2 - r, middle_sign),
        (size // 2 + r, middle_sign * mirror_sign),
    ):
        if sign:
            folded.setdefault(source % size, sign)
    return folded


def _groups(size: int) -> list[tuple[bool, list[int], list[int], int]]:
    """Matrices of the transform: (is it of sines, outputs, inputs, sign of the fold at N/4)."""
    half, below_half = size // 2, (size - 1) // 2
    if size % 2:
        inner = list(range(1, below_half + 1))
        return [(False, [0, *inner], [0, *inner], 0), (True, inner, inner, 0)]
    quarter = size // 4
    even, odd = list(range(0, half + 1, 2)), list(range(1, half + 1, 2))
    to_quarter, before_quarter = range(quarter + 1), range((half + 1) // 2)
    return [
        (False, even, list(to_quarter), 1),
        (False, odd, list(before_quarter), -1),
        (True, [q for q in odd if q < half], list(to_quarter)[1:], 1),
        (True, [q for q in even if 0 < q < half], list(before_quarter)[1:], -1),
    ]


def _axis(size: int) -> _Axis:
    groups = _groups(size)
    longest = max(1, *(max(len(outputs), len(inputs)) for _, outputs, inputs, _ in groups))
    height = -(-longest // _UNROLLED) * _UNROLLED
    sources = np.zeros((len(groups) * height, 4), np.int64)
    signs = np.zeros((len(groups) * height, 4), np.float32)
    matrices = np.zeros((len(groups), height, height), np.float32)
    extents = np.zeros((len(groups), 2), np.int64)
    # Sines of q = 0 and q = N/2 are zero; any row will do.
    rows = {False: np.zeros(size, np.int64), True: np.zeros(size, np.int64)}
    sine_signs = np.zeros(size, np.float32)
    for g, (is_sine, outputs, inputs, middle_sign) in enumerate(groups):
        angles = 2 * np.pi / size * np.outer(outputs, inputs)
        matrix = np.sin(angles) if is_sine else np.cos(angles)
        matrices[g, : len(outputs), : len(inputs)] = matrix
        extents[g] = [-(-len(side) // _UNROLLED) * _UNROLLED for side in (outputs, inputs)]
        for i, r in enumerate(inputs):
            folded = _folded_inputs(size, r, -1 if is_sine else 1, middle_sign)
            sources[g * height + i, : len(folded)] = list(folded)
            signs[g * height + i, : len(folded)] = list(folded.values())
        for i, q in enumerate(outputs):
            rows[is_sine][q] = rows[is_sine][-q] = g * height + i
            if is_sine:
                sine_signs[q], sine_signs[-q] = 1, -1
    return _Axis(sources, signs, matrices, extents, rows[False], rows[True], sine_signs)


@njit(cache=True, nogil=True, fastmath={"contract"})
def _add_four(a, b, c, d, signs, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    p, q, r, s = signs[0], signs[1], signs[2], signs[3]
    for lane in range(a.size):
        out[lane] = p * a[lane] + q * b[lane] + r * c[lane] + s * d[lane]


@njit(cache=True, nogil=True)
def _add_two(a, b, signs, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    p, q = signs[0], signs[1]
    for lane in range(a.size):
        out[lane] = p * a[lane] + q * b[lane]


@njit(cache=True, nogil=True, fastmath={"contract"})
def _multiply(matrix, rows, columns, x, out, lanes):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Matrix times rows of lanes, four rows by four columns at a time, to load and store less."""
    for i in range(0, rows, 4):
        out0, out1, out2, out3 = out[i], out[i + 1], out[i + 2], out[i + 3]
        for lane in range(lanes):
            out0[lane] = out1[lane] = out2[lane] = out3[lane] = np.float32(0)
        m0, m1, m2, m3 = matrix[i], matrix[i + 1], matrix[i + 2], matrix[i + 3]
        for j in range(0, columns, 4):
            a0, a1, a2, a3 = m0[j], m0[j + 1], m0[j + 2], m0[j + 3]
            b0, b1, b2, b3 = m1[j], m1[j + 1], m1[j + 2], m1[j + 3]
            c0, c1, c2, c3 = m2[j], m2[j + 1], m2[j + 2], m2[j + 3]
            d0, d1, d2, d3 = m3[j], m3[j + 1], m3[j + 2], m3[j + 3]
            in0, in1, in2, in3 = x[j], x[j + 1], x[j + 2], x[j + 3]
            for lane in range(lanes):
                x0, x1, x2, x3 = in0[lane], in1[lane], in2[lane], in3[lane]
                out0[lane] = a3 * x3 + (a2 * x2 + (a1 * x1 + (a0 * x0 + out0[lane])))
                out1[lane] = b3 * x3 + (b2 * x2 + (b1 * x1 + (b0 * x0 + out1[lane])))
                out2[lane] = c3 * x3 + (c2 * x2 + (c1 * x1 + (c0 * x0 + out2[lane])))
                out3[lane] = d3 * x3 + (d2 * x2 + (d1 * x1 + (d0 * x0 + out3[lane])))


@njit(cache=True, nogil=True)
def _scale(x, factor, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    for i in range(x.size):
        out[i] = factor * x[i]


@njit(cache=True, nogil=True, fastmath={"contract"})
def _add_scaled(x, y, factor, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    for i in range(x.size):
        out[i] = x[i] + factor * y[i]


@njit(cache=True, nogil=True)
def _fold(lanes, axis, start, stop, folded, at):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Rows that the matrices are multiplied with, of a block of lanes, from lane ``at`` on."""
    groups, height, _ = axis.matrices.shape
    for g in range(groups):
        for i in range(g * height, g * height + axis.extents[g, 1]):
            a, b, c, d = axis.sources[i]
            first, second, signs = lanes[a, start:stop], lanes[b, start:stop], axis.signs[i]
            if groups == _GROUPS_OF_ODD:
                _add_two(first, second, signs, folded[i, at:])
            else:
                third, fourth = lanes[c, start:stop], lanes[d, start:stop]
                _add_four(first, second, third, fourth, signs, folded[i, at:])


@njit(cache=True, nogil=True)
def _sums(axis, folded, products, lanes):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Cosine and sine sums of folded rows."""
    groups, height, _ = axis.matrices.shape
    for g in range(groups):
        rows, columns = axis.extents[g]
        first = g * height
        _multiply(axis.matrices[g], rows, columns, folded[first:], products[first:], lanes)


@njit(cache=True, nogil=True)
def _transform_columns(x, axis, folded, products, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Real (columns, rows, channels) to half spectra (rows, 2, half, channels) along columns."""
    columns, rows, channels = x.shape
    lanes = x.reshape((columns, rows * channels))
    block = folded.shape[1] // channels
    for first in range(0, rows, block):
        last = min(first + block, rows)
        _fold(lanes, axis, first * channels, last * channels, folded, 0)
        _sums(axis, folded, products, (last - first) * channels)
        for q in range(out.shape[2]):
            cosines, sines = products[axis.cosines[q]], products[axis.sines[q]]
            for y in range(first, last):
                here = slice((y - first) * channels, (y - first + 1) * channels)
                _scale(cosines[here], np.float32(1), out[y, 0, q])
                _scale(sines[here], -axis.sine_signs[q], out[y, 1, q])


@njit(cache=True, nogil=True)
def _transform_rows(x, axis, direction, folded, products):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Transform (rows, 2, half, channels) along rows, in place; back if the direction is −1."""
    rows, _, half, channels = x.shape
    length = half * channels
    lanes = x.reshape((rows, 2 * length))
    block = folded.shape[1] // 2
    for first in range(0, length, block):
        last = min(first + block, length)
        size = last - first
        _fold(lanes, axis, first, last, folded, 0)
        _fold(lanes, axis, length + first, length + last, folded, size)
        _sums(axis, folded, products, 2 * size)
        for q in range(rows):
            cosines, sines = products[axis.cosines[q]], products[axis.sines[q]]
            sign, out = direction * axis.sine_signs[q], lanes[q]
            _add_scaled(cosines[:size], sines[size : 2 * size], sign, out[first:last])
            _add_scaled(
                cosines[size : 2 * size], sines[:size], -sign, out[length + first : length + last]
            )


@njit(cache=True, nogil=True)
def _invert_columns(x, axis, folded, products, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Half spectra (rows, 2, half, channels) along columns to real (channels, rows, columns).

    Cosine sums only see what is even in k, here the real parts, and sine sums what is odd, the
    imaginary ones; so one number can hold both (Hartley's transform).
    """
    rows, _, half, channels = x.shape
    columns = out.shape[2]
    both = np.empty((columns, rows * channels), np.float32)
    for k in range(half):
        for y in range(rows):
            here = slice(y * channels, (y + 1) * channels)
            _add_scaled(x[y, 0, k], x[y, 1, k], np.float32(1), both[k, here])
            if 0 < k < columns - k:
                _add_scaled(x[y, 0, k], x[y, 1, k], np.float32(-1), both[columns - k, here])
    block = folded.shape[1] // channels
    scale = np.float32(1 / (rows * columns))
    for first in range(0, rows, block):
        last = min(first + block, rows)
        _fold(both, axis, first * channels, last * channels, folded, 0)
        _sums(axis, folded, products, (last - first) * channels)
        for q in range(columns):
            cosines, sines = products[axis.cosines[q]], products[axis.sines[q]]
            sign = axis.sine_signs[q]
            for y in range(first, last):
                for channel in range(channels):
                    lane = (y - first) * channels + channel
                    out[channel, y, q] = scale * (cosines[lane] - sign * sines[lane])


class TransformPlan(NamedTuple):
    """How to transform feature maps of one size; ``folded`` and ``products`` are scratch."""

    rows: _Axis
    columns: _Axis
    folded: Real
    products: Real


def plan_transform(grid_hw: tuple[int, int], channels: int) -> TransformPlan:
    """Plan the transform of maps.

    Parameters
    ----------
    grid_hw : tuple of int
        Rows and columns of the maps.
    channels : int
        How many maps at a time, at most.
    """
    rows, columns = (_axis(size) for size in grid_hw)
    height = max(len(rows.sources), len(columns.sources))
    # Lanes at a time: whole pairs of all channels, few enough for the nearer caches.
    lanes = max(1, _BLOCK_BYTES // (4 * height * 2 * channels)) * 2 * channels
    folded, products = np.empty((2, height, lanes), np.float32)
    return TransformPlan(rows, columns, folded, products)


@njit(cache=True, nogil=True)
def transform(x, plan, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Transform feature maps.

    Parameters
    ----------
    x : ndarray of float32
        (columns, rows, channels).
    plan : TransformPlan
        For maps of this size.
    out : ndarray of float32
        (rows, 2, columns // 2 + 1, channels): real and imaginary parts of the half spectra;
        overwritten.
    """
    _transform_columns(x, plan.columns, plan.folded, plan.products, out)
    _transform_rows(out, plan.rows, np.float32(1), plan.folded, plan.products)


@njit(cache=True, nogil=True)
def invert(x_f, plan, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Transform back.

    Parameters
    ----------
    x_f : ndarray of float32
        (rows, 2, columns // 2 + 1, n), n at most the plan's number of channels; overwritten.
    plan : TransformPlan
        For maps of this size.
    out : ndarray of float32
        (n, rows, columns); overwritten.
    """
    _transform_rows(x_f, plan.rows, np.float32(-1), plan.folded, plan.products)
    _invert_columns(x_f, plan.columns, plan.folded, plan.products, out)
