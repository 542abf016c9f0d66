"""Histograms of oriented gradients with 31 channels (fHOG).

References
----------
P. Felzenszwalb et al., Object detection with discriminatively trained part-based models, PAMI
2010, in the variant of P. Dollár's toolbox that the authors' code uses: bilinear weights in
space, nearest orientation of 18, cells at the border scaled up for the pixels they miss.
"""

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from situp_annotate.types import Image

__all__ = ["HOG_CHANNELS", "fhog"]

_SIGNED = 18
_UNSIGNED = 9
_BLOCKS = 4
HOG_CHANNELS = _SIGNED + _UNSIGNED + _BLOCKS

_CLIP = 0.2
_BORDER_GAIN = 8 / 7
_TEXTURE_GAIN = 0.2357
_COSINE_STEPS = 10_000


def _orientations() -> npt.NDArray[np.int64]:
    """Nearest of 18 orientations by the cosine −1 … 1: (2, 20001), rows for down and for up.

    The authors' code truncates the cosine to the steps of a table too, and works in single
    precision, which decides where exactly vertical gradients fall: midway between two bins.
    """
    cosines = np.arange(-_COSINE_STEPS, _COSINE_STEPS + 1) / np.float32(_COSINE_STEPS)
    down = np.minimum(np.arccos(cosines).astype(np.float32), np.float32(math.pi - 1e-6))
    angles = np.stack([down, down + np.float32(math.pi)])
    bins = (angles * np.float32(_SIGNED / (2 * math.pi)) + np.float32(0.5)).astype(np.int64)
    return bins % _SIGNED


_ORIENTATIONS = _orientations()


@njit(cache=True, nogil=True)
def _gradient(patch, y, x):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Steepest channel's gradient: magnitude, x and y part; of equals the first of R, G, B."""
    rows, columns, channels = patch.shape
    above, below = max(y - 1, 0), min(y + 1, rows - 1)
    left, right = max(x - 1, 0), min(x + 1, columns - 1)
    half_y = 0.5 if below - above == 2 else 1.0
    half_x = 0.5 if right - left == 2 else 1.0
    best, best_x, best_y = -1.0, 0.0, 0.0
    for channel in range(channels - 1, -1, -1):
        along_x = half_x * (float(patch[y, right, channel]) - float(patch[y, left, channel]))
        along_y = half_y * (float(patch[below, x, channel]) - float(patch[above, x, channel]))
        squared = along_x * along_x + along_y * along_y
        if squared > best:
            best, best_x, best_y = squared, along_x, along_y
    return math.sqrt(best), best_x, best_y


@njit(cache=True, nogil=True)
def _raise_border(histograms):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Scale the outermost cells up for the pixels they miss (loops compile in a tenth the time)."""
    rows, columns, orientations = histograms.shape
    for row in range(1, rows - 1):
        for column in range(1, columns - 1):
            gain = 1.0
            if row in (1, rows - 2):
                gain *= _BORDER_GAIN
            if column in (1, columns - 2):
                gain *= _BORDER_GAIN
            if gain > 1.0:
                for o in range(orientations):
                    histograms[row, column, o] *= gain


@njit(cache=True, nogil=True)
def _cell_histograms(patch, cell, orientations, histograms):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Add to (rows + 2, columns + 2, 18) histograms: the grid of cells with a margin of one."""
    rows, columns = histograms.shape[0] - 2, histograms.shape[1] - 2
    unit = 1.0 / (255.0 * cell * cell)
    for y in range(rows * cell):
        position_y = (y + 0.5) / cell + 0.5
        row = int(position_y)
        below = position_y - row
        for x in range(columns * cell):
            magnitude, along_x, along_y = _gradient(patch, y, x)
            if magnitude == 0.0:
                continue
            up = along_y < 0
            cosine = (-along_x if up else along_x) / magnitude
            bin_ = orientations[int(up), int(cosine * _COSINE_STEPS) + _COSINE_STEPS]
            weight = magnitude * unit
            position_x = (x + 0.5) / cell + 0.5
            column = int(position_x)
            right = position_x - column
            histograms[row, column, bin_] += weight * (1 - below) * (1 - right)
            histograms[row, column + 1, bin_] += weight * (1 - below) * right
            histograms[row + 1, column, bin_] += weight * below * (1 - right)
            histograms[row + 1, column + 1, bin_] += weight * below * right
    _raise_border(histograms)


@njit(cache=True, nogil=True)
def _block_norms(cells, epsilon, norms):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """1 / length of each 2×2 block of cells, (rows + 1, columns + 1), borders repeated."""
    rows, columns, _ = cells.shape
    energy = np.zeros((rows, columns), np.float64)
    for i in range(rows):
        for j in range(columns):
            for o in range(_UNSIGNED):
                both = cells[i, j, o] + cells[i, j, o + _UNSIGNED]
                energy[i, j] += both * both
    for i in range(rows + 1):
        top = min(max(i - 1, 0), max(rows - 2, 0))
        bottom = min(top + 1, rows - 1)
        for j in range(columns + 1):
            left = min(max(j - 1, 0), max(columns - 2, 0))
            right = min(left + 1, columns - 1)
            total = (
                energy[top, left] + energy[top, right] + energy[bottom, left]
                + energy[bottom, right]
            )  # fmt: skip
            norms[i, j] = 1.0 / math.sqrt(total + epsilon)


@njit(cache=True, nogil=True)
def _normalise(cells, norms, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Each cell by its four blocks: 18 signed, 9 unsigned, 4 texture channels."""
    rows, columns, _ = cells.shape
    for i in range(rows):
        for j in range(columns):
            for block in range(_BLOCKS):
                norm = norms[i + 1 - (block & 1), j + 1 - (block >> 1)]
                texture = 0.0
                for o in range(_SIGNED):
                    value = min(cells[i, j, o] * norm, _CLIP)
                    out[o, i, j] += 0.5 * value
                    texture += value
                for o in range(_UNSIGNED):
                    both = cells[i, j, o] + cells[i, j, o + _UNSIGNED]
                    out[_SIGNED + o, i, j] += 0.5 * min(both * norm, _CLIP)
                out[_SIGNED + _UNSIGNED + block, i, j] = _TEXTURE_GAIN * texture


@njit(cache=True, nogil=True)
def _fhog(patches, cell, orientations, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    rows, columns = out.shape[2], out.shape[3]
    histograms = np.empty((rows + 2, columns + 2, _SIGNED), np.float32)
    norms = np.empty((rows + 1, columns + 1), np.float64)
    for n in range(patches.shape[0]):
        histograms.fill(0.0)
        _cell_histograms(patches[n], cell, orientations, histograms)
        cells = histograms[1 : rows + 1, 1 : columns + 1]
        _block_norms(cells, 1e-4 / 4 / cell**4, norms)
        _normalise(cells, norms, out[n])


def fhog(patches: Image, cell_size: int, out: npt.NDArray[np.float32]) -> None:
    """Compute the 31 fHOG channels of windows.

    Parameters
    ----------
    patches : Image
        (n, height, width, channels), uint8; colour takes the steepest channel at each pixel.
    cell_size : int
        Side of a cell in pixels.
    out : ndarray of float32
        (n, 31, height // cell_size, width // cell_size); overwritten. Pixels beyond the last
        whole cell only lend their gradients.
    """
    out[:] = 0.0
    _fhog(patches, cell_size, _ORIENTATIONS, out)
