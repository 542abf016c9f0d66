"""Where runs begin: one pass, temporal (TRE) and spatial (SRE) robustness.

References
----------
Y. Wu, J. Lim, M.-H. Yang, Online object tracking: a benchmark, CVPR 2013, section 4, and the
toolkit's ``splitSeqTRE.m`` and ``shiftInitBB.m``.

Notes
-----
The toolkit leaves out further frames in which the target is hidden, by lists of its own; here only
those count as hidden whose truth is not positive.
"""

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

__all__ = ["SEGMENTS", "SHIFTS", "shifted_boxes", "temporal_starts"]

SEGMENTS = 20
"""Runs of a temporal robustness evaluation."""

_SHORTEST = 20

_SHARE = 0.1

# The sides that move: left, top, right, bottom, in tenths of the target's size.
SHIFTS: Mapping[str, tuple[int, int, int, int]] = {
    "left": (-1, 0, -1, 0),
    "right": (1, 0, 1, 0),
    "up": (0, -1, 0, -1),
    "down": (0, 1, 0, 1),
    "top left": (-1, -1, 0, 0),
    "top right": (0, -1, 1, 0),
    "bottom left": (-1, 0, 0, 1),
    "bottom right": (0, 0, 1, 1),
}
"""Shifts of spatial robustness: of the whole box, or of one corner, which enlarges it."""

_SCALES = (0.8, 0.9, 1.1, 1.2)


def temporal_starts(truth: npt.NDArray[np.float64]) -> list[int]:
    """Frames that runs to the end begin in, spread over the frames that have a target.

    Parameters
    ----------
    truth : ndarray
        (n, 4), counted from 1.

    Returns
    -------
    list of int
        From 0, increasing: ``SEGMENTS`` of them, the last with 20 frames to go at least; fewer
        where there are not enough frames. The first frame with a target is always one.
    """
    present = np.flatnonzero((truth > 0).all(axis=1))
    usable = int((len(truth) - present >= _SHORTEST).sum())
    if usable == 0:
        return [int(frame) for frame in present[:1]]
    # MATLAB's floor(1 : usable / 19 : usable), and the last, counted from 1.
    steps = np.arange(SEGMENTS - 1) * (usable / (SEGMENTS - 1)) + 1
    places = [*np.floor(steps[steps <= usable]).astype(int).tolist(), usable]
    return sorted({int(present[place - 1]) for place in places})


def shifted_boxes(
    box: tuple[float, float, float, float], size_hw: tuple[int, int]
) -> list[tuple[float, float, float, float]]:
    """Boxes to begin with instead of the truth: 8 shifts by a tenth of the size, 4 scales.

    Parameters
    ----------
    box : tuple of float
        x, y, width, height, counted from 1.
    size_hw : tuple of int
        Height and width of the picture; boxes are cut off at its borders.
    """
    moved = [_shift(box, sides) for sides in SHIFTS.values()]
    scaled = [_scale(box, ratio) for ratio in _SCALES]
    return [_inside(each, size_hw) for each in (*moved, *scaled)]


def _round(value: float) -> float:
    """As MATLAB: halves away from zero."""
    return math.copysign(math.floor(abs(value) + 0.5), value)


def _shift(
    box: tuple[float, float, float, float], sides: tuple[int, int, int, int]
) -> tuple[float, float, float, float]:
    x, y, width, height = box
    left, top, right, bottom = sides
    if (left, top) == (right, bottom):
        across, down = math.ceil(_SHARE * width), math.ceil(_SHARE * height)
        return x + left * across, y + top * down, width, height
    new_x = _round(x + left * _SHARE * width) if left else x
    new_y = _round(y + top * _SHARE * height) if top else y
    end_x, end_y = x + width - 1, y + height - 1
    end_x = _round(end_x + right * _SHARE * width) if right else end_x
    end_y = _round(end_y + bottom * _SHARE * height) if bottom else end_y
    return new_x, new_y, end_x - new_x + 1, end_y - new_y + 1


def _scale(
    box: tuple[float, float, float, float], ratio: float
) -> tuple[float, float, float, float]:
    x, y, width, height = box
    wide, high = ratio * width, ratio * height
    corner = x + width / 2 - wide / 2, y + height / 2 - high / 2
    return _round(corner[0]), _round(corner[1]), _round(wide), _round(high)


def _inside(
    box: tuple[float, float, float, float], size_hw: tuple[int, int]
) -> tuple[float, float, float, float]:
    """Cut off what sticks out; a pixel remains of what would vanish."""
    x, y = max(box[0], 1.0), max(box[1], 1.0)
    width = min(box[2], size_hw[1] - x + 1)
    height = min(box[3], size_hw[0] - y + 1)
    return x, y, max(width, 1.0), max(height, 1.0)
