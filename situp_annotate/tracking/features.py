"""Stack the channels that the filter sees: fHOG, grey and colour names under a cosine window.

§III-B of the paper. Colour: 31 fHOG + 1 grey + 10 colour names = 42 channels. Grey: 31 fHOG + 1
grey, which counts twice as in the authors' code, 33 channels to them: to the linear kernel two
equal channels are one that is √2 times as high.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from situp_annotate.tracking.color_names import (
    COLOR_CHANNELS,
    add_color_names,
    builtin_table,
    load_table,
)
from situp_annotate.tracking.hog import HOG_CHANNELS, orientation_table
from situp_annotate.tracking.params import TrackerParams
from situp_annotate.tracking.resizing import Resizing, plan_resizing, resize

__all__ = ["FeaturePlan", "add_colors", "luma", "plan_features", "turn_grey"]

Real = npt.NDArray[np.float32]


class FeaturePlan(NamedTuple):
    """How to turn windows of one size into feature maps.

    ``cosine_window`` has the maps' rows and columns, ``color_table`` no rows for grey windows.
    """

    cell_size: int
    hog: bool
    gray: bool
    orientations: npt.NDArray[np.uint8]
    resizing: Resizing
    cosine_window: Real
    grey_gain: float
    color_table: Real

    @property
    def channels(self) -> int:
        """How many maps there are: 42 for colour, 32 for grey; one without grey stays zero."""
        return self.first_color + (COLOR_CHANNELS if len(self.color_table) else 0)

    @property
    def first_color(self) -> int:
        """The map after HOG and grey."""
        return (HOG_CHANNELS if self.hog else 0) + 1

    @property
    def elements(self) -> int:
        """Rows · columns · channels as the authors count them: 42 for colour, 33 for grey."""
        doubled = self.gray and self.grey_gain > 1.0
        return self.cosine_window.size * (self.channels - (not self.gray) + doubled)


def _gray_gain(params: TrackerParams, *, color: bool) -> float:
    if "gray" not in params.features:
        return 0.0
    stands_twice = not color and "color" in params.features
    return float(np.sqrt(2)) if stands_twice else 1.0


def plan_features(window_hw: tuple[int, int], params: TrackerParams, *, color: bool) -> FeaturePlan:
    """Plan the features of windows.

    Parameters
    ----------
    window_hw : tuple of int
        Rows and columns of a window in pixels.
    params : TrackerParams
        ``cell_size`` and ``color_table`` are used.
    color : bool
        Whether windows have three channels.
    """
    rows, columns = (size // params.cell_size for size in window_hw)
    table = np.empty((0, COLOR_CHANNELS), np.float32)
    table.setflags(write=False)
    if color and "color" in params.features:
        path = params.color_table
        table = builtin_table() if path is None else load_table(path)
    return FeaturePlan(
        cell_size=params.cell_size,
        hog="hog" in params.features,
        gray="gray" in params.features,
        orientations=orientation_table(),
        resizing=plan_resizing(window_hw, (rows, columns)),
        cosine_window=np.outer(np.hanning(rows), np.hanning(columns)).astype(np.float32),
        grey_gain=_gray_gain(params, color=color),
        color_table=table,
    )


@njit(cache=True, nogil=True)
def luma(blue, green, red):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Grey of a colour, rounded to a whole number 0–255 (ITU-R BT.601)."""
    return np.floor(
        0.298936021293775 * red + 0.587043074451121 * green + 0.114020904255103 * blue + 0.5
    )


@njit(cache=True, nogil=True)
def turn_grey(image, span, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Compute a part of a picture in grey.

    Parameters
    ----------
    image : Image
        (height, width, 3), uint8, in the order B, G, R.
    span : tuple of int
        First row and the one after the last, first column and the one after the last.
    out : Image
        (height, width, 1), uint8, of which that part is overwritten.
    """
    for y in range(span[0], span[1]):
        for x in range(span[2], span[3]):
            blue, green, red = image[y, x]
            out[y, x, 0] = np.uint8(luma(float(blue), float(green), float(red)))


@njit(cache=True, nogil=True)
def _add_grey(small, gain, weights, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    columns, rows, channels = small.shape
    for j in range(columns):
        for i in range(rows):
            pixel = small[j, i]
            level = float(pixel[0])
            if channels == 3:
                level = luma(level, float(pixel[1]), float(pixel[2]))
            out[j, i] = gain * weights[i, j] * (level / 255.0 - 0.5)


@njit(cache=True, nogil=True)
def add_colors(window, plan, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Compute the channels after fHOG: grey and colour names.

    Parameters
    ----------
    window : Image
        (rows, 1 or 3, columns), uint8; three channels in the order B, G, R.
    plan : FeaturePlan
        For windows of this size.
    out : ndarray of float32
        (columns, rows, channels) of the maps; those after fHOG's are overwritten.
    """
    if not plan.gray and plan.color_table.shape[0] == 0:
        return
    small, weights = resize(window, plan.resizing), plan.cosine_window
    gray = HOG_CHANNELS if plan.hog else 0
    _add_grey(small, plan.grey_gain, weights, out[:, :, gray])
    if plan.color_table.shape[0]:
        add_color_names(small, plan.color_table, weights, out[:, :, gray + 1 :])
