"""Histograms of oriented gradients with 31 channels (fHOG).

References
----------
P. Felzenszwalb et al., Object detection with discriminatively trained part-based models, PAMI
2010, in the variant of P. Dollár's toolbox that the authors' code uses: bilinear weights in
space, nearest orientation of 18, cells at the border scaled up for the pixels they miss.

Notes
-----
Grey levels are whole numbers, so a gradient is one of few: two whole numbers of half levels per
pixel. Its orientation is therefore looked up, and the table can afford to hold exactly what the
authors' code computes from the 12-bit estimate of 1/√x that processors have: that decides to
which of two orientations a gradient between them goes.
"""

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from numba import njit

__all__ = ["HOG_CHANNELS", "fhog", "orientation_table"]

_SIGNED = 18
_UNSIGNED = 9
_BLOCKS = 4
HOG_CHANNELS = _SIGNED + _UNSIGNED + _BLOCKS
_STRIDE = 32

_CLIP = np.float32(0.2)
_BORDER_GAIN = np.float32(8 / 7)
_TEXTURE_GAIN = np.float32(0.2357)
_HALF = np.float32(0.5)
_ONE = np.float32(1)
_STEEPEST = 510
"""Largest difference along one axis, in half levels per pixel: black beside white at a border."""
_SPAN = 2 * _STEEPEST + 1
_MIDDLE = np.float32(_SPAN**2 // 2 + 0.5)
_CODE_OF_X = np.float32(510 * _SPAN)
_CODE_OF_Y = np.float32(510)
_COSINE_STEPS = 10_000

Real = npt.NDArray[np.float32]


def _estimate_inverse_root(x: Real) -> Real:
    """1/√x as processors estimate it: at the middle of 1024 steps per octave, to 12 bits."""
    mantissa, exponent = np.frexp(x.astype(np.float64))
    middle = (np.floor(mantissa * 2048) + 0.5) / 2048
    mantissa, exponent = np.frexp(1 / np.sqrt(np.ldexp(middle, exponent)))
    estimate: Real = np.ldexp(np.round(mantissa * 8192) / 8192, exponent).astype(np.float32)
    return estimate


@lru_cache(maxsize=1)
def orientation_table() -> npt.NDArray[np.uint8]:
    """Nearest of 18 orientations of each gradient (dx, dy), in half levels per pixel.

    At ``_SPAN · dx + dy`` from the middle of the table.
    """
    level = np.float32(0.5 / 255)
    squares = np.arange(2 * _STEEPEST**2 + 1).astype(np.float32) * level**2
    inverse_lengths = np.zeros_like(squares)
    inverse_lengths[1:] = _estimate_inverse_root(squares[1:])
    across = np.arange(-_STEEPEST, _STEEPEST + 1)
    dx, dy = across[:, np.newaxis], across
    cosine = np.where(dy < 0, -dx, dx) * level * inverse_lengths[dx * dx + dy * dy]
    steps = (cosine * np.float32(_COSINE_STEPS)).astype(np.int32)
    # In single precision, which decides where vertical gradients fall: midway between two bins.
    fraction = np.arange(-_COSINE_STEPS, _COSINE_STEPS + 1) / np.float32(_COSINE_STEPS)
    angles = np.minimum(np.arccos(fraction).astype(np.float32), np.float32(math.pi - 1e-6))
    angle = angles[np.clip(steps, -_COSINE_STEPS, _COSINE_STEPS) + _COSINE_STEPS]
    angle += np.where(dy < 0, np.float32(math.pi), np.float32(0))
    bins = (angle * np.float32(_SIGNED / (2 * math.pi)) + _HALF).astype(np.uint8) % _SIGNED
    return bins.ravel()


@njit(cache=True, nogil=True)
def _keep_steeper(left, right, up, down, gains_x, gain_y, codes, squares):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Put one channel's gradients where they are steeper than those that are there.

    ``codes`` gets the places in the table of orientations, ``squares`` the squared lengths, of
    levels in 0–1. In single precision like the authors', so that channels tie where theirs do.
    The arrays are distinct and the index plain: only such loops become vector code.
    """
    for x in range(codes.size):
        along_x = gains_x[x] * (right[x] - left[x])
        along_y = gain_y * (down[x] - up[x])
        square = along_x * along_x + along_y * along_y
        code = np.int32(_CODE_OF_X * along_x + _CODE_OF_Y * along_y + _MIDDLE)
        steeper = square > squares[x]
        codes[x] = code if steeper else codes[x]
        squares[x] = square if steeper else squares[x]


@njit(cache=True, nogil=True)
def _read_row(pixels, levels):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Levels 0–1 of a row (channels, width) between copies of its ends (channels, width + 2)."""
    channels, width = pixels.shape
    for channel in range(channels):
        row, padded = pixels[channel], levels[channel]
        inside = padded[1 : width + 1]
        for x in range(width):
            inside[x] = np.float32(row[x]) / np.float32(255.0)
        padded[0], padded[width + 1] = inside[0], inside[width - 1]


@njit(cache=True, nogil=True)
def _steepest(here, up, down, gains_x, gain_y, codes, squares):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Gradients of one row, of the steepest channel; of equals the first of R, G, B."""
    squares[:] = -_ONE
    for channel in range(here.shape[0] - 1, -1, -1):
        row = here[channel]
        _keep_steeper(
            row[: codes.size], row[2:], up[channel][1:], down[channel][1:], gains_x, gain_y,
            codes, squares,
        )  # fmt: skip


@njit(cache=True, nogil=True)
def _add_row(orientations, codes, squares, offsets, rights, histograms):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Add a row of pixels to a row of histograms (columns + 2, 18), flat, with a margin of one."""
    for x in range(offsets.size):
        magnitude = np.sqrt(squares[x])
        right_part = magnitude * rights[x]
        left = offsets[x] + orientations[np.uint32(codes[x])]
        histograms[left] += magnitude - right_part
        histograms[left + np.uint32(_SIGNED)] += right_part


@njit(cache=True, nogil=True)
def _spread(row, above, below, upper, lower):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Move a row's histograms into those of the two rows of cells that share it."""
    for i in range(row.size):
        upper[i] += above * row[i]
        lower[i] += below * row[i]
        row[i] = np.float32(0)


@njit(cache=True, nogil=True)
def _cell_histograms(window, orientations, cell, histograms):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Histograms of the grid of cells with a margin of one: (rows + 2, (columns + 2) · 18)."""
    height, channels, width = window.shape
    used = (histograms.shape[1] // _SIGNED - 2) * cell
    offsets, rights = np.empty(used, np.uint32), np.empty(used, np.float32)
    for x in range(used):
        position = (x + 0.5) / cell + 0.5
        offsets[x] = int(position) * _SIGNED
        rights[x] = position - int(position)
    gains_x = np.full(width, _HALF)
    gains_x[0] = gains_x[width - 1] = _ONE
    codes, squares = np.empty(width, np.int32), np.empty(width, np.float32)
    row_histograms = np.zeros(histograms.shape[1], np.float32)
    levels = np.empty((3, channels, width + 2), np.float32)  # of rows y - 1, y and y + 1
    _read_row(window[0], levels[0])
    histograms[:] = 0.0
    for y in range((histograms.shape[0] - 2) * cell):
        above, below = max(y - 1, 0), min(y + 1, height - 1)
        if below > y:
            _read_row(window[below], levels[below % 3])
        gain_y = _HALF if below - above == 2 else _ONE
        here, up, down = levels[y % 3], levels[above % 3], levels[below % 3]
        _steepest(here, up, down, gains_x, gain_y, codes, squares)
        _add_row(orientations, codes, squares, offsets, rights, row_histograms)
        position = (y + 0.5) / cell + 0.5
        row = int(position)
        part_below = np.float32((position - row) / cell**2)
        part_above = np.float32(1.0 / cell**2) - part_below
        _spread(row_histograms, part_above, part_below, histograms[row], histograms[row + 1])


@njit(cache=True, nogil=True)
def _finish_row(histograms, i, cells, energy):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Drop the margin, scale border cells up for the pixels they miss, append the unsigned bins.

    ``cells`` is (columns, 32), of which 27 are used; ``energy`` (columns,).
    """
    rows, columns = histograms.shape[0] - 2, energy.size
    for j in range(columns):
        cell = cells[j]
        margin = histograms[i + 1, (j + 1) * _SIGNED : (j + 2) * _SIGNED]
        gain = _BORDER_GAIN if i in (0, rows - 1) else _ONE
        gain *= _BORDER_GAIN if j in (0, columns - 1) else _ONE
        for o in range(_SIGNED):
            cell[o] = gain * margin[o]
        total = np.float32(0.0)
        for o in range(_UNSIGNED):
            both = cell[o] + cell[o + _UNSIGNED]
            cell[o + _SIGNED] = both
            total += both * both
        energy[j] = total


@njit(cache=True, nogil=True)
def _block_norms(upper, lower, epsilon, norms):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """1 / length of each 2×2 block between two rows of cells; the border's are repeated."""
    columns = upper.size
    for j in range(columns + 1):
        left = min(max(j - 1, 0), max(columns - 2, 0))
        right = min(left + 1, columns - 1)
        total = upper[left] + upper[right] + lower[left] + lower[right]
        norms[j] = _ONE / np.sqrt(total + epsilon)


@njit(cache=True, nogil=True)
def _clipped_sums(cell, a, b, c, d, gain, feature):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    for o in range(_STRIDE):
        value = cell[o]
        feature[o] = gain * (
            min(value * a, _CLIP) + min(value * b, _CLIP)
            + min(value * c, _CLIP) + min(value * d, _CLIP)
        )  # fmt: skip


@njit(cache=True, nogil=True, fastmath={"reassoc", "nnan", "nsz"})
def _textures(cell, a, b, c, d):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    in_a = in_b = in_c = in_d = np.float32(0)
    for o in range(_SIGNED):
        value = cell[o]
        in_a += min(value * a, _CLIP)
        in_b += min(value * b, _CLIP)
        in_c += min(value * c, _CLIP)
        in_d += min(value * d, _CLIP)
    return in_a, in_b, in_c, in_d


@njit(cache=True, nogil=True)
def _normalise(cells, above, below, weights, out, i):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """A row of cells by their four blocks: 18 signed, 9 unsigned, 4 texture channels, weighted."""
    for j in range(weights.size):
        cell, feature, weight = cells[j], out[j, i], weights[j]
        a, b, c, d = below[j + 1], above[j + 1], below[j], above[j]
        _clipped_sums(cell, a, b, c, d, _HALF * weight, feature)
        in_a, in_b, in_c, in_d = _textures(cell, a, b, c, d)
        gain = _TEXTURE_GAIN * weight
        feature[27], feature[28] = gain * in_a, gain * in_b
        feature[29], feature[30] = gain * in_c, gain * in_d


@njit(cache=True, nogil=True)
def fhog(window, orientations, cell_size, weights, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Compute the 31 fHOG channels of a window.

    Parameters
    ----------
    window : Image
        (height, channels, width), uint8, one or three channels in the order B, G, R; at each
        pixel the steepest counts.
    orientations : ndarray of uint8
        From :func:`orientation_table`.
    cell_size : int
        Side of a cell in pixels.
    weights : ndarray of float32
        (height // cell_size, width // cell_size), with which each cell is multiplied. Pixels
        beyond the last whole cell only lend their gradients.
    out : ndarray of float32
        (columns, rows, ≥ 32): columns before rows, as the transform wants them; the first 31
        channels are overwritten, and the one after them may be.
    """
    rows, columns = weights.shape
    histograms = np.empty((rows + 2, (columns + 2) * _SIGNED), np.float32)
    _cell_histograms(window, orientations, cell_size, histograms)
    # Row by row, to stay in the nearest cache: of cells i - 1 and i, of norms above and below.
    cells = np.zeros((2, columns, _STRIDE), np.float32)
    energy = np.empty((2, columns), np.float32)
    norms = np.empty((2, columns + 1), np.float32)
    epsilon = np.float32(1e-4 / 4 / cell_size**4)
    _finish_row(histograms, 0, cells[0], energy[0])
    for i in range(1, rows):
        this, last = i % 2, (i - 1) % 2
        _finish_row(histograms, i, cells[this], energy[this])
        _block_norms(energy[last], energy[this], epsilon, norms[this])
        above = norms[this] if i == 1 else norms[last]
        _normalise(cells[last], above, norms[this], weights[i - 1], out, i - 1)
    last = (rows - 1) % 2
    _normalise(cells[last], norms[last], norms[last], weights[rows - 1], out, rows - 1)
