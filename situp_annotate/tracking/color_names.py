"""Colour names: how much a colour is black, blue, brown, grey, and so on.

Each of 32×32×32 bins of RGB has a row of ten numbers: the probabilities of the eleven basic
colour terms, less their mean, in coordinates of the ten-dimensional space that they span. The
linear kernel only sees inner products, so the basis of that space is free.

References
----------
J. van de Weijer et al., Learning color names for real-world applications, TIP 2009, gave the
table that the authors' code uses. The model here is a fit of our own to such probabilities: a
softmax over 24 quadratic forms in CIELab, each of one term.
"""

import zipfile
import zlib
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from numba import njit

from situp_annotate.errors import TrackingError

__all__ = ["COLOR_CHANNELS", "add_color_names", "builtin_table", "load_table"]

COLOR_CHANNELS = 10
_BINS = 32
_TERMS = 11

# Term (alphabetically: black 0, blue 1, brown 2, grey 3, green 4, orange 5, pink 6, purple 7,
# red 8, white 9, yellow 10) and coefficients of 1, l, a, b, l², la, lb, a², ab, b².
_FORMS = (
    (0, 2.52, -3.57, -2.19, -1.95, 1.78, 0.86, -1.27, -1.78, 0.43, 1.86),
    (0, 3.18, 0.15, -3.69, -1.60, 0.82, -0.35, -0.10, -7.65, -1.07, -7.35),
    (1, -0.20, -3.89, -3.50, -8.74, 1.24, -1.85, -4.17, -1.11, -7.87, 6.71),
    (1, 1.62, 1.40, -4.98, -11.51, 0.96, -4.56, 4.06, 5.50, -2.56, -3.64),
    (1, -4.91, 12.21, -12.82, -11.37, -6.07, 9.11, -0.99, 7.01, -13.05, 0.15),
    (1, 2.37, 1.30, -4.43, -2.56, -7.08, -4.06, 4.16, 6.26, 11.66, -7.59),
    (2, -2.22, -13.11, 0.29, 3.85, -6.19, -1.37, 2.13, 4.80, 4.79, 4.67),
    (2, 0.18, 0.40, 7.61, 10.28, -4.08, -5.71, -0.70, -1.72, -6.21, 0.21),
    (2, 3.14, -0.76, 0.03, 1.62, 0.99, -0.70, 0.27, 1.02, 4.65, 3.93),
    (3, 3.71, 3.81, -3.13, 0.32, -4.51, 1.41, 2.83, -3.33, -2.36, -13.38),
    (3, 4.42, -0.00, -2.73, -0.38, 0.20, -0.71, -0.47, -3.32, 2.05, 0.79),
    (4, 1.50, -1.42, -13.46, 0.68, -0.24, -2.77, 5.97, 1.36, -2.29, 2.34),
    (4, -4.58, -1.35, -4.58, 6.93, 9.14, 7.34, 7.10, -9.00, 3.60, -4.82),
    (4, 2.29, 0.35, -9.59, 4.02, 1.52, -2.62, -2.05, -2.78, -3.25, 4.36),
    (5, -0.32, 1.27, 4.27, 6.17, 3.04, -1.61, -0.44, 4.47, 2.07, 4.54),
    (6, 2.08, 4.35, 6.30, 3.02, -1.13, -0.98, -3.17, 2.81, -4.30, 0.89),
    (6, -1.14, -5.44, 9.19, -7.94, -1.53, 6.46, -6.73, 4.42, 8.50, -3.16),
    (7, -10.06, 2.23, 16.54, -9.86, 4.35, 5.11, 2.69, -4.19, -3.45, 5.18),
    (7, -3.85, -2.32, 17.14, -10.09, 0.80, 0.54, -1.79, -2.21, 7.08, 4.75),
    (7, 2.65, -0.50, 3.84, -4.20, 1.92, 0.78, -0.02, -0.04, -3.21, -0.64),
    (8, 0.01, -0.52, 7.64, -0.62, 1.92, -0.00, -5.21, 3.83, 6.35, 2.85),
    (9, 3.74, 3.20, -3.19, 0.62, 0.86, 0.57, -0.22, -3.97, 0.04, -2.67),
    (10, -5.41, 1.67, -2.00, 24.01, -2.18, -1.92, -1.75, -3.54, -2.75, -4.26),
    (10, -0.72, 0.54, -2.56, 9.28, 3.46, -2.98, -0.14, 3.15, 1.16, 4.26),
)

# sRGB (D65) to XYZ over the white point, IEC 61966-2-1.
_XYZ_OF_RGB = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
_WHITE = np.array([0.95047, 1.0, 1.08883])


def _product(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Matrix product without BLAS, which would wake a thread per core in every worker."""
    product: npt.NDArray[np.float64] = np.einsum("ij,jk->ik", a, b)
    return product


def _lab(rgb: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """CIELab (D65) of sRGB 0–255, last axis."""
    value = rgb / 255
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    xyz = _product(linear, _XYZ_OF_RGB.T) / _WHITE
    delta = 6 / 29
    f = np.where(xyz > delta**3, np.cbrt(xyz), xyz / (3 * delta**2) + 4 / 29)
    x, y, z = np.moveaxis(f, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def _probabilities(rgb: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Probability of each of the eleven terms for sRGB colours 0–255, (n, 3) → (n, 11)."""
    lightness, a, b = (_lab(rgb) / [50, 60, 60] - [1, 0, 0]).T
    linear = [np.ones_like(a), lightness, a, b]
    quadratic = [lightness**2, lightness * a, lightness * b, a**2, a * b, b**2]
    monomials = np.stack(linear + quadratic)
    forms = np.array(_FORMS)
    exponents = _product(forms[:, 1:], monomials)
    weights = np.exp(exponents - exponents.max(axis=0))
    terms = np.zeros((_TERMS, len(rgb)))
    np.add.at(terms, forms[:, 0].astype(int), weights)
    probabilities: npt.NDArray[np.float64] = (terms / terms.sum(axis=0)).T
    return probabilities


def _centred(probabilities: npt.NDArray[np.float64]) -> npt.NDArray[np.float32]:
    """Rows of eleven probabilities in a Helmert basis of the space orthogonal to (1, …, 1)."""
    basis = np.zeros((_TERMS, COLOR_CHANNELS))
    for k in range(1, _TERMS):
        basis[:k, k - 1] = 1
        basis[k, k - 1] = -k
    basis /= np.linalg.norm(basis, axis=0)
    return _product(probabilities - 1 / _TERMS, basis).astype(np.float32)


@lru_cache(maxsize=1)
def builtin_table() -> npt.NDArray[np.float32]:
    """Compute the table of the built-in model: (32768, 10), evaluated at the bins' centres."""
    centers = 8.0 * np.arange(_BINS) + 4
    blue, green, red = np.meshgrid(centers, centers, centers, indexing="ij")
    table = _centred(_probabilities(np.stack([red, green, blue], axis=-1).reshape(-1, 3)))
    table.setflags(write=False)
    return table


def _read(path: str) -> npt.NDArray[np.float64]:
    # NumPy itself would fetch whatever address a path looks like.
    with open(path, "rb") as file:  # noqa: PTH123 - no pathlib in here
        if path.endswith((".txt", ".csv")):
            return np.loadtxt(file)
        loaded = np.load(file)
        if isinstance(loaded, np.lib.npyio.NpzFile):
            (name,) = loaded.files
            loaded = loaded[name]
        return np.asarray(loaded, np.float64)


@lru_cache(maxsize=4)
def load_table(path: str) -> npt.NDArray[np.float32]:
    """Read a full colour-name table that the user owns.

    Parameters
    ----------
    path : str
        A ``.npy`` file, an ``.npz`` file with one array, or text with one bin a line; 32768 rows
        at index R // 8 + 32 · (G // 8) + 1024 · (B // 8), of 10 numbers as they are used, or of
        11 probabilities.

    Raises
    ------
    TrackingError
        If the file cannot be read or has another shape.
    """
    try:
        loaded = _read(path)
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise TrackingError(
            f"{path}: this colour-name table cannot be read ({error}); give a .npy, .npz or text "
            f"file."
        ) from error
    rows = _centred(loaded) if loaded.shape == (_BINS**3, _TERMS) else loaded
    if rows.shape != (_BINS**3, COLOR_CHANNELS) or not np.isfinite(rows).all():
        raise TrackingError(
            f"{path}: a colour-name table has 32768 rows of 10 or 11 finite numbers, "
            f"this one has shape {loaded.shape}."
        )
    table = np.array(rows, np.float32, order="C")
    table.setflags(write=False)
    return table


@njit(cache=True, nogil=True)
def add_color_names(image, table, weights, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Look up the colour names of a picture.

    Parameters
    ----------
    image : Image
        (columns, rows, 3), uint8, in the order B, G, R.
    table : ndarray of float32
        (32768, 10).
    weights : ndarray of float32
        (rows, columns), with which each pixel's names are multiplied.
    out : ndarray of float32
        (columns, rows, 10): columns before rows, as the transform wants them; overwritten.
    """
    for j in range(image.shape[0]):
        for i in range(image.shape[1]):
            pixel = image[j, i]
            blue, green, red = pixel[0] >> 3, pixel[1] >> 3, pixel[2] >> 3
            names = table[red + _BINS * green + _BINS * _BINS * blue]
            for name in range(COLOR_CHANNELS):
                out[j, i, name] = weights[i, j] * names[name]
