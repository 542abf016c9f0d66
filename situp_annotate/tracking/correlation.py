"""The kernelised correlation filter with a linear kernel, §III-A and §III-B of the paper.

Names that end in ``_f`` are half spectra of real arrays, (…, rows, columns // 2 + 1). All
functions take and give plain arrays.
"""

import numpy as np
import numpy.typing as npt
from scipy import fft

__all__ = ["gaussian_labels", "interpolate", "respond", "spectrum", "train"]

Real = npt.NDArray[np.float32]
Complex = npt.NDArray[np.complex64]


def gaussian_labels(grid_hw: tuple[int, int], sigma: float) -> Real:
    """Regression target y of equation (2): a Gaussian with its peak at [0, 0], wrapped around.

    Parameters
    ----------
    grid_hw : tuple of int
        Rows and columns of the feature grid.
    sigma : float
        Standard deviation in cells.
    """
    rows, columns = (
        np.minimum(np.arange(size), size - np.arange(size)).astype(np.float64) for size in grid_hw
    )
    squared = rows[:, np.newaxis] ** 2 + columns**2
    return np.exp(-0.5 / sigma**2 * squared).astype(np.float32)


def spectrum(x: Real) -> Complex:
    """Half spectra of real maps over their last two axes."""
    transformed: Complex = fft.rfft2(x)
    return transformed


def _correlation(z_f: Complex, x_f: Complex, columns: int) -> Complex:
    """Spectrum of the linear kernel correlation, equation (12), per element.

    Dividing by the number of elements (rows · columns · channels) is the authors' code's; it
    makes λ independent of the template's size.
    """
    channels, rows, _ = x_f.shape
    kernel_f: Complex = np.einsum("...cij,cij->...ij", z_f, x_f.conj())
    return kernel_f / np.float32(rows * columns * channels)


def train(x_f: Complex, labels_f: Complex, columns: int, regularization: float) -> Complex:
    """Dual coefficients of equation (7): α̂ = ŷ / (k̂ˣˣ + λ).

    Parameters
    ----------
    x_f : ndarray
        (channels, rows, columns // 2 + 1), features of the training window.
    labels_f : ndarray
        (rows, columns // 2 + 1).
    columns : int
        Columns of the grid before the transform.
    regularization : float
        λ.
    """
    return labels_f / (_correlation(x_f, x_f, columns).real + np.float32(regularization))


def respond(alpha_f: Complex, template_f: Complex, z_f: Complex, columns: int) -> Real:
    """Response maps of equations (9) and (10).

    Parameters
    ----------
    alpha_f, template_f : ndarray
        The model: (rows, columns // 2 + 1) and (channels, rows, columns // 2 + 1).
    z_f : ndarray
        (n, channels, rows, columns // 2 + 1), features of the windows to search.
    columns : int
        Columns of the grid before the transform.

    Returns
    -------
    ndarray of float32
        (n, rows, columns); the peak's place is the displacement in cells, wrapped around.
    """
    response_f = alpha_f * _correlation(z_f, template_f, columns)
    response: Real = fft.irfft2(response_f, s=(alpha_f.shape[0], columns))
    return response


def interpolate(old: Complex, new: Complex, rate: float) -> Complex:
    """Update of the model, equation (11): ``rate`` of the new, the rest of the old."""
    return np.float32(1 - rate) * old + np.float32(rate) * new
