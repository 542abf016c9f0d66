"""One-pass evaluation with the conventions of the OTB toolkit.

References
----------
Y. Wu, J. Lim, M.-H. Yang, Object tracking benchmark, PAMI 2015.

M. Müller et al., TrackingNet, ECCV 2018 (normalised precision).

Notes
-----
Conventions that change figures: the first frame's truth counts as the result; a result that is
no box repeats the one before; success counts overlaps *above* a threshold, precision counts
errors *up to* one; a frame whose truth has a number that is not positive, position included, is
a miss in success but a hit in precision (a quirk that published figures contain).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from situp_annotate.propagation.fusion import overlaps

__all__ = [
    "NORMALIZED_THRESHOLDS",
    "PRECISION_PIXELS",
    "PRECISION_THRESHOLDS",
    "THRESHOLDS",
    "OnePassResult",
    "center_errors",
    "evaluate_one_pass",
    "normalized_errors",
]

Boxes = npt.NDArray[np.float64]

THRESHOLDS = np.linspace(0, 1, 21)
"""Overlap thresholds of the success curve; its mean is the AUC."""

PRECISION_THRESHOLDS = np.arange(51.0)
"""Centre errors in pixels of the precision plot."""

NORMALIZED_THRESHOLDS = np.linspace(0, 0.5, 51)
"""Centre errors in sizes of the target; the mean of their shares is the normalised precision."""

PRECISION_PIXELS = 20
"""Centre error in pixels up to which a frame counts where precision is a single figure."""

_ABSENT = -1.0


def center_errors(boxes: Boxes, truth: Boxes) -> npt.NDArray[np.float64]:
    """Distance of the centres in pixels, frame by frame; shapes as for `overlaps`."""
    apart = boxes[:, :2] + boxes[:, 2:] / 2 - truth[:, :2] - truth[:, 2:] / 2
    return np.hypot(apart[:, 0], apart[:, 1])


def normalized_errors(boxes: Boxes, truth: Boxes) -> npt.NDArray[np.float64]:
    """Distance of the centres in the truth's widths and heights; shapes as for `overlaps`."""
    apart = boxes[:, :2] + boxes[:, 2:] / 2 - truth[:, :2] - truth[:, 2:] / 2
    share: npt.NDArray[np.float64] = np.hypot(*(apart / truth[:, 2:]).T)
    return share


@dataclass(frozen=True, slots=True)
class OnePassResult:
    """Scores of one target.

    Attributes
    ----------
    overlaps, center_errors, normalized_errors : ndarray
        (n,), of every frame; −1 where the truth is not positive.
    """

    overlaps: npt.NDArray[np.float64]
    center_errors: npt.NDArray[np.float64]
    normalized_errors: npt.NDArray[np.float64]

    @property
    def success(self) -> npt.NDArray[np.float64]:
        """(21,): share of frames whose overlap is above each of ``THRESHOLDS``."""
        share: npt.NDArray[np.float64] = (self.overlaps[:, np.newaxis] > THRESHOLDS).mean(axis=0)
        return share

    @property
    def auc(self) -> float:
        """Area under the success curve: the mean of its 21 values."""
        return float(self.success.mean())

    @property
    def precision(self) -> float:
        """Share of frames with a centre error of at most 20 pixels."""
        return float((self.center_errors <= PRECISION_PIXELS).mean())


def _is_box(boxes: Boxes) -> npt.NDArray[np.bool_]:
    return np.logical_and(np.isfinite(boxes).all(axis=1), (boxes[:, 2:] > 0).all(axis=1))


def _repeat_over_gaps(boxes: Boxes) -> Boxes:
    last_valid = np.maximum.accumulate(np.where(_is_box(boxes), np.arange(len(boxes)), 0))
    return boxes[last_valid]


def evaluate_one_pass(boxes: Boxes, truth: Boxes) -> OnePassResult:
    """Score the boxes of one run from the first frame's truth on.

    Parameters
    ----------
    boxes, truth : ndarray
        (n, 4) each: x, y, width, height, of the same origin. Surplus rows of either are ignored.

    Raises
    ------
    ValueError
        If there is nothing to compare.
    """
    count = min(len(boxes), len(truth))
    if count == 0:
        raise ValueError("There is nothing to evaluate: no boxes or no truth.")
    boxes, truth = boxes[:count].copy(), truth[:count]
    boxes[0] = truth[0]
    boxes = _repeat_over_gaps(boxes)
    present = (truth > 0).all(axis=1)

    def measured(measure: Callable[[Boxes, Boxes], npt.NDArray[np.float64]]) -> Boxes:
        values = np.full(count, _ABSENT)
        values[present] = measure(boxes[present], truth[present])
        return values

    return OnePassResult(measured(overlaps), measured(center_errors), measured(normalized_errors))
