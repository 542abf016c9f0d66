"""Fit the coefficients of confidence to samples, and judge them on sequences left out."""

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from situp_annotate.evaluation.samples import Samples
from situp_annotate.propagation.confidence import feature_names

__all__ = ["fit", "predict_left_out", "sequence_of"]

Array = npt.NDArray[np.float64]

_PENALTY = 1e-3


def sequence_of(target: str) -> str:
    """Sequence that a target is from: targets of one sequence look alike."""
    return target.split(".", maxsplit=1)[0]


def fit(samples: Samples, overlap: float) -> dict[str, float]:
    """Coefficients of the logistic model, by name.

    Every target weighs the same, however many frames it has; a small quadratic penalty keeps
    coefficients finite that no sample speaks of.

    Parameters
    ----------
    samples : Samples
        At least one.
    overlap : float
        From which a box counts as right, in [0, 1].
    """
    weights = _fit(samples, overlap)
    return dict(zip(feature_names(), (round(float(weight), 2) for weight in weights), strict=True))


def predict_left_out(samples: Samples, overlap: float) -> Array:
    """Probability of each sample, (n,), by coefficients fitted without its sequence."""
    sequences = np.array([sequence_of(target) for target in samples.target])
    probability = np.empty(len(sequences))
    for sequence in np.unique(sequences):
        left_out = sequences == sequence
        weights = _fit(samples.where(~left_out), overlap)
        probability[left_out] = 1 / (1 + np.exp(-samples.features[left_out] @ weights))
    return probability


def _fit(samples: Samples, overlap: float) -> Array:
    _, numbers, counts = np.unique(samples.target, return_inverse=True, return_counts=True)
    share = 1 / counts[numbers]
    right = samples.overlap >= overlap
    sign = np.where(right, -1.0, 1.0)

    def loss(weights: Array) -> tuple[float, Array]:
        odds = samples.features @ weights
        excess = share * (1 / (1 + np.exp(-odds)) - right)
        value = float(share @ np.logaddexp(0, sign * odds) + _PENALTY * weights @ weights)
        return value, samples.features.T @ excess + 2 * _PENALTY * weights

    start = np.zeros(samples.features.shape[1])
    weights: Array = minimize(loss, start, jac=True, method="L-BFGS-B").x
    return weights
