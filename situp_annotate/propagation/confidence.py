"""How far a box can be trusted: the probability that it overlaps the object well enough.

A logistic model of what is known of a box. Its coefficients are fitted by
``benchmarks/confidence.py`` and stored in ``confidence.json`` beside this module.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib import resources

import numpy as np
import numpy.typing as npt

__all__ = ["GOOD", "PRECISE", "Evidence", "Kind", "design_matrix", "feature_names", "probability"]

Array = npt.NDArray[np.float64]

GOOD = 0.5
"""Overlap with the object from which a box counts as right: what ``confidence`` is about."""

PRECISE = 0.7
"""Overlap from which a box needs no correction: what suggestions for review are about."""


class Kind(StrEnum):
    """How a box came about."""

    AGREED = "agreed"
    ONE_PASS = "one_pass"
    BRIDGED = "bridged"
    OPEN = "open"
    LOST = "lost"
    INTERPOLATED = "interpolated"


@dataclass(frozen=True, slots=True)
class Evidence:
    """What is known of the boxes of a stretch: arrays of (n,), one entry a frame.

    Attributes
    ----------
    kind : ndarray of int
        Index of the :class:`Kind`.
    peak : ndarray
        Height of the response's peak of the pass that is trusted; the mean if both are; 0 without.
    weakest : ndarray
        The lowest peak on the way from the keyframe, each the median of five; 0 without. After a
        moment in which the target was hardly seen, the tracker may follow something else.
    agreement : ndarray
        Overlap of both passes, in [0, 1]; 0 without a second one.
    met : ndarray
        Overlap of the trusted pass with the human box at its far end, in [0, 1]; 0 without.
    distance : ndarray
        Frames to the nearest keyframe, as log(1 + frames).
    drift : ndarray
        Size as log(√area), off the straight line between the keyframes' sizes; ≥ 0.
    """

    kind: npt.NDArray[np.int64]
    peak: Array
    weakest: Array
    agreement: Array
    met: Array
    distance: Array
    drift: Array


_MEASURES = ("peak", "weakest", "met", "distance", "drift")


def feature_names() -> tuple[str, ...]:
    """Names of the columns of :func:`design_matrix`: a constant for each kind, then measures.

    How well the passes agree counts only where both are trusted. The distance counts apart for
    boxes that no tracker found, since only they go astray with distance alone.
    """
    return (*Kind, *_MEASURES, "agreement", "distance_untracked")


def design_matrix(evidence: Evidence) -> Array:
    """The evidence as the logistic model takes it, (n, features)."""
    kinds = np.eye(len(Kind))[evidence.kind]
    of = {kind: kinds[:, column] for column, kind in enumerate(Kind)}
    measures = [getattr(evidence, name) for name in _MEASURES]
    agreed = of[Kind.AGREED] * (evidence.agreement - 1)
    untracked = (of[Kind.BRIDGED] + of[Kind.INTERPOLATED]) * evidence.distance
    return np.column_stack([kinds, *measures, agreed, untracked])


@cache
def _coefficients() -> Mapping[str, Mapping[str, float]]:
    text = resources.files("situp_annotate.propagation").joinpath("confidence.json").read_text()
    coefficients: Mapping[str, Mapping[str, float]] = json.loads(text)["coefficients"]
    return coefficients


def probability(evidence: Evidence, overlap: float = GOOD) -> Array:
    """Probability of each box, (n,) in [0, 1], to overlap the object by at least `overlap`.

    Parameters
    ----------
    evidence : Evidence
        What is known of the boxes.
    overlap : float
        ``GOOD`` or ``PRECISE``.
    """
    named = _coefficients()[str(overlap)]
    weights = np.array([named[name] for name in feature_names()])
    odds = design_matrix(evidence) @ weights
    chance: Array = 1 / (1 + np.exp(-np.clip(odds, -30, 30)))
    return chance
