"""What a response map says: where its peak is, how high, and how sharp the map is (APCE)."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit

__all__ = ["Peak", "apce", "find_peak", "psr"]


@dataclass(frozen=True, slots=True)
class Peak:
    """The peak of a response map.

    Attributes
    ----------
    offset_yx : tuple of int
        Displacement in cells, wrapped at half of the map: negative is up and to the left.
    value : float
        The response there.
    fine_yx : tuple of float
        The displacement between the cells: the vertex of a parabola through the peak and its two
        neighbours, for each axis, at most half a cell away. Not in the paper.
    """

    offset_yx: tuple[int, int]
    value: float
    fine_yx: tuple[float, float]


@njit(cache=True, nogil=True)
def _apce(response):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    rows, columns = response.shape
    lowest = highest = float(response[0, 0])
    for i in range(rows):
        for j in range(columns):
            lowest = min(lowest, float(response[i, j]))
            highest = max(highest, float(response[i, j]))
    energy = 0.0
    for i in range(rows):
        for j in range(columns):
            energy += (response[i, j] - lowest) ** 2
    return (highest - lowest) ** 2 * response.size / energy if energy > 0.0 else 0.0


def apce(response: npt.NDArray[np.floating]) -> float:
    """Average peak-to-correlation energy, equation (13), in double precision.

    Unchanged by a·R + b for a > 0 and by rolling. A constant map has no peak: 0.
    """
    return float(_apce(response))


def psr(response: npt.NDArray[np.floating], *, exclude: int = 1) -> float:
    """Peak-to-sidelobe ratio: peak over mean, in standard deviations of all but the peak's cells.

    Parameters
    ----------
    response : ndarray
        (rows, columns).
    exclude : int
        Cells around the peak, to each side, that are no sidelobe.

    References
    ----------
    D. S. Bolme et al., Visual object tracking using adaptive correlation filters, CVPR 2010.
    """
    row, column = np.unravel_index(int(np.argmax(response)), response.shape)
    centred = np.roll(response, (exclude - row, exclude - column), (0, 1))
    side = np.ones(response.shape, np.bool_)
    side[: 2 * exclude + 1, : 2 * exclude + 1] = False
    sidelobe = centred[side].astype(np.float64)
    spread = float(sidelobe.std()) if sidelobe.size else 0.0
    return (float(response[row, column]) - float(sidelobe.mean())) / spread if spread > 0 else 0.0


def _wrap(index: int, size: int) -> int:
    """Displacement that an index stands for; the authors' code wraps from the middle on."""
    return index - size if index + 1 > size / 2 else index


def _vertex(before: float, peak: float, after: float) -> float:
    """Where a parabola through three neighbours, the middle one highest, has its vertex."""
    curvature = before - 2 * peak + after
    return 0.5 * (before - after) / curvature if curvature < 0 else 0.0


def find_peak(response: npt.NDArray[np.floating]) -> Peak:
    """Find the highest response; of equal ones the first, column by column."""
    rows, columns = response.shape
    column, row = divmod(int(np.argmax(response.T)), rows)
    value = float(response[row, column])
    y, x = _wrap(row, rows), _wrap(column, columns)
    above, below = float(response[row - 1, column]), float(response[(row + 1) % rows, column])
    left, right = float(response[row, column - 1]), float(response[row, (column + 1) % columns])
    fine_yx = (y + _vertex(above, value, below), x + _vertex(left, value, right))
    return Peak(offset_yx=(y, x), value=value, fine_yx=fine_yx)
