"""Boxes as a hand draws them: near the truth, but not on it."""

import zlib

import numpy as np
import numpy.typing as npt

from situp_annotate.propagation.fusion import overlaps

__all__ = ["LEAST_OVERLAP", "MOST_OVERLAP", "jitter"]

Boxes = npt.NDArray[np.float64]

LEAST_OVERLAP, MOST_OVERLAP = 0.85, 0.95
"""Bounds of the overlap of a jittered box with its truth."""

_HALVINGS = 40


def jitter(truth: Boxes, name: str) -> Boxes:
    """Move and resize each box at random until it overlaps the truth as much as a hand's would.

    Parameters
    ----------
    truth : ndarray
        (n, 4): x, y, width, height; NaN where the object is absent.
    name : str
        The target's, from which the random numbers are seeded.

    Returns
    -------
    ndarray
        (n, 4); each box overlaps the truth by a share drawn evenly from 0.85 to 0.95, and is
        displaced, widened and heightened in random proportions. NaN where the truth is.
    """
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    wanted = rng.uniform(LEAST_OVERLAP, MOST_OVERLAP, len(truth))
    course = rng.normal(size=(len(truth), 4))
    course /= np.linalg.norm(course, axis=1, keepdims=True)
    # The whole course overlaps by less than wanted, none of it by 1: what is wanted lies between.
    low, high = np.zeros(len(truth)), np.ones(len(truth))
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        near = overlaps(_displaced(truth, course * middle[:, np.newaxis]), truth) > wanted
        low, high = np.where(near, middle, low), np.where(near, high, middle)
    return _displaced(truth, course * low[:, np.newaxis])


def _displaced(boxes: Boxes, by: Boxes) -> Boxes:
    """Move centres by shares of width and height, and multiply both by exp of the rest."""
    size = boxes[:, 2:] * np.exp(by[:, 2:])
    center = boxes[:, :2] + boxes[:, 2:] * (0.5 + by[:, :2])
    return np.hstack([center - size / 2, size])
