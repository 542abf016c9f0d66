"""How far the confidence of boxes tells the right ones from the wrong ones."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.stats import rankdata

__all__ = ["Calibration", "calibration"]

_RIGHT = 0.5
_BINS = 10
_REVIEWED = 0.1

Array = npt.NDArray[np.float64]


class Calibration(NamedTuple):
    """Figures of a confidence.

    Attributes
    ----------
    auroc : float
        Probability that a right box has more confidence than a wrong one, ties by halves; NaN if
        all boxes are right, or all are wrong.
    ece : float
        Expected calibration error over ten bins of equal width, in [0, 1].
    share : float
        Share of the wrong boxes among the least confident tenth of all; NaN without wrong ones.
    """

    auroc: float
    ece: float
    share: float


def calibration(confidence: Array, overlap: Array) -> Calibration:
    """Compare confidences with what came true.

    Parameters
    ----------
    confidence : ndarray
        (n,), in [0, 1]; without any, all figures are NaN.
    overlap : ndarray
        (n,), with the truth; a box is right if it is at least 0.5.
    """
    right = overlap >= _RIGHT
    return Calibration(
        _auroc(confidence, right), _expected_error(confidence, right), _share(confidence, right)
    )


def _auroc(confidence: Array, right: npt.NDArray[np.bool_]) -> float:
    good, bad = int(right.sum()), int((~right).sum())
    if good == 0 or bad == 0:
        return float("nan")
    above = rankdata(confidence)[right].sum() - good * (good + 1) / 2
    return float(above / (good * bad))


def _expected_error(confidence: Array, right: npt.NDArray[np.bool_]) -> float:
    if len(confidence) == 0:
        return float("nan")
    bins = np.minimum((confidence * _BINS).astype(int), _BINS - 1)
    surplus = np.bincount(bins, weights=confidence - right, minlength=_BINS)
    return float(np.abs(surplus).sum() / len(confidence))


def _share(confidence: Array, right: npt.NDArray[np.bool_]) -> float:
    if right.all():
        return float("nan")
    reviewed = np.argsort(confidence, kind="stable")[: max(1, round(_REVIEWED * len(confidence)))]
    return float((~right[reviewed]).sum() / (~right).sum())
