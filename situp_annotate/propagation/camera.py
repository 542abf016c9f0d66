"""How the scene moves from picture to picture: what a shaking or turning camera does to it."""

import math

import cv2
import numpy as np
import numpy.typing as npt

from situp_annotate.types import Image

__all__ = ["CameraMotion"]

_SIDE = 160
_MOST = 0.3


class CameraMotion:
    """Translation of the whole scene, by phase correlation of pictures made small.

    Turning and zooming are not measured. Call it with every picture in turn.
    """

    def __init__(self) -> None:
        self._before: npt.NDArray[np.float32] | None = None
        self._window = np.empty((0, 0), np.float32)

    def __call__(self, image: Image) -> tuple[float, float]:
        """How far the scene has moved since the picture before, in pixels: right and down.

        Nothing, (0, 0), for the first picture, where no motion is to be seen, and where it would
        be more than three tenths of the picture, which is a cut rather than a motion.
        """
        small, zoom = _shrink(image)
        before, self._before = self._before, small
        if before is None:
            window = cv2.createHanningWindow(small.shape[::-1], cv2.CV_32F)
            self._window = np.asarray(window, np.float32)
            return 0.0, 0.0
        (x, y), _ = cv2.phaseCorrelate(before, small, self._window)
        if not (math.isfinite(x) and math.isfinite(y)):
            return 0.0, 0.0
        if abs(x) > _MOST * small.shape[1] or abs(y) > _MOST * small.shape[0]:
            return 0.0, 0.0
        return x * zoom, y * zoom


def _shrink(image: Image) -> tuple[npt.NDArray[np.float32], float]:
    """A small grey picture, and how many pixels one of its pixels stands for."""
    height, width = image.shape[:2]
    zoom = max(1.0, max(height, width) / _SIDE)
    # Hanning windows of OpenCV need two pixels at least.
    size = (max(2, round(width / zoom)), max(2, round(height / zoom)))
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    grey = cv2.cvtColor(small, cv2.COLOR_BGR2GRAY) if small.ndim == 3 else small
    return np.array(grey, np.float32), zoom
