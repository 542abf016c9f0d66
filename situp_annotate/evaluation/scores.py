"""Curves of a target, and their means over targets."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from situp_annotate.evaluation.metrics import (
    NORMALIZED_THRESHOLDS,
    PRECISION_PIXELS,
    PRECISION_THRESHOLDS,
    THRESHOLDS,
    OnePassResult,
)

__all__ = ["Scores", "mean_scores", "pooled_scores"]

Curve = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Scores:
    """Shares of frames, in [0, 1].

    Attributes
    ----------
    success_curve : tuple of float
        21: overlap above each of ``THRESHOLDS``.
    precision_curve : tuple of float
        51: centre error up to each of ``PRECISION_THRESHOLDS``.
    normalized_curve : tuple of float
        51: normalised centre error up to each of ``NORMALIZED_THRESHOLDS``.
    """

    success_curve: Curve
    precision_curve: Curve
    normalized_curve: Curve

    @property
    def auc(self) -> float:
        """Mean of the success curve."""
        return float(np.mean(self.success_curve))

    @property
    def precision(self) -> float:
        """Share of frames with a centre error of at most 20 pixels."""
        return self.precision_curve[PRECISION_PIXELS]

    @property
    def normalized_precision(self) -> float:
        """Mean of the curve of normalised precision."""
        return float(np.mean(self.normalized_curve))


def pooled_scores(runs: Sequence[OnePassResult]) -> Scores:
    """Scores of one target from all frames of one or more runs together, as the toolkit pools them.

    Parameters
    ----------
    runs : sequence of OnePassResult
        At least one.
    """
    overlap, error, normalized = (
        np.concatenate([getattr(run, name) for run in runs])[:, np.newaxis]
        for name in ("overlaps", "center_errors", "normalized_errors")
    )
    return Scores(
        _curve(overlap > THRESHOLDS),
        _curve(error <= PRECISION_THRESHOLDS),
        _curve(normalized <= NORMALIZED_THRESHOLDS),
    )


def mean_scores(scores: Sequence[Scores]) -> Scores:
    """Mean over targets, each of the same weight whatever its length.

    Parameters
    ----------
    scores : sequence of Scores
        At least one.
    """
    success, precision, normalized = (
        _curve(np.array([getattr(each, name) for each in scores]))
        for name in ("success_curve", "precision_curve", "normalized_curve")
    )
    return Scores(success, precision, normalized)


def _curve(rows: npt.NDArray[np.generic]) -> Curve:
    return tuple(float(value) for value in rows.mean(axis=0))
