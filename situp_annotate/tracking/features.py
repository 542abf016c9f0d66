"""Stack the channels that the filter sees: fHOG, grey and colour names under a cosine window."""

import numpy as np
import numpy.typing as npt

from situp_annotate.tracking.color_names import (
    COLOR_CHANNELS,
    builtin_table,
    color_names,
    load_table,
)
from situp_annotate.tracking.hog import HOG_CHANNELS, fhog
from situp_annotate.tracking.params import TrackerParams
from situp_annotate.tracking.resizing import Resizer
from situp_annotate.types import Image

__all__ = ["FeatureExtractor", "luma"]


def luma(images: Image) -> npt.NDArray[np.float32]:
    """Grey of B, G, R pictures (…, 3), rounded to whole numbers 0–255 (ITU-R BT.601)."""
    weighted = images[..., 0] * 0.1140 + images[..., 1] * 0.5870 + images[..., 2] * 0.2989
    rounded: npt.NDArray[np.float32] = np.floor(weighted + 0.5).astype(np.float32)
    return rounded


class FeatureExtractor:
    """Turns windows of one size into feature maps; §III-B of the paper.

    Colour: 31 fHOG + 1 grey + 10 colour names = 42 channels. Grey: 31 fHOG + twice the grey
    channel = 33, as in the authors' code.

    Parameters
    ----------
    window_hw : tuple of int
        Rows and columns of a window in pixels.
    color : bool
        Whether windows have three channels.
    params : TrackerParams
        ``cell_size`` and ``color_table`` are used.
    """

    def __init__(self, window_hw: tuple[int, int], *, color: bool, params: TrackerParams) -> None:
        self._cell_size = params.cell_size
        self.grid_hw = (window_hw[0] // params.cell_size, window_hw[1] // params.cell_size)
        self.channels = HOG_CHANNELS + (1 + COLOR_CHANNELS if color else 2)
        self._shrink = Resizer(window_hw, self.grid_hw)
        self._window = np.outer(np.hanning(self.grid_hw[0]), np.hanning(self.grid_hw[1]))
        self._window = self._window.astype(np.float32)
        self._table: npt.NDArray[np.float32] | None = None
        if color:
            path = params.color_table
            self._table = builtin_table() if path is None else load_table(path)

    def __call__(self, windows: Image) -> npt.NDArray[np.float32]:
        """Compute the features of windows (n, rows, columns, 1 or 3).

        Returns
        -------
        ndarray of float32
            (n, channels, grid rows, grid columns).
        """
        features = np.empty((len(windows), self.channels, *self.grid_hw), np.float32)
        fhog(windows, self._cell_size, features[:, :HOG_CHANNELS])
        small = self._shrink(windows)
        if self._table is None:
            features[:, HOG_CHANNELS:] = small[:, np.newaxis, :, :, 0] / np.float32(255) - 0.5
        else:
            features[:, HOG_CHANNELS] = luma(small) / 255 - 0.5
            features[:, HOG_CHANNELS + 1 :] = color_names(small, self._table)
        features *= self._window
        return features
