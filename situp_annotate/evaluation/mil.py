"""OpenCV's TrackerMIL, the one that CVAT offers, as a tracker to compare with."""

import cv2

from situp_annotate.errors import TrackingError
from situp_annotate.tracking import Estimate
from situp_annotate.types import BoundingBox, Image

__all__ = ["MilTracker"]

_SEED = 1


class MilTracker:
    """TrackerMIL with its defaults; where it reports nothing, its box stays where it was.

    It follows the position only. It knows nothing of APCE and of peaks, which are 0.

    Notes
    -----
    It draws from two sources of random numbers. OpenCV's own is seeded here for each target and
    picture; the other cannot be reached and goes on from tracker to tracker. What repeats is
    therefore the work of a whole process, not that of a second tracker in it.

    References
    ----------
    B. Babenko, M.-H. Yang, S. Belongie, Visual tracking with online multiple instance learning,
    CVPR 2009.
    """

    def __init__(self) -> None:
        self._tracker: cv2.TrackerMIL | None = None
        self._box: BoundingBox | None = None
        self._pictures = 0

    def init(self, image: Image, box: BoundingBox) -> None:
        """Learn the target from its box in a first picture; forget any target before."""
        cv2.setRNGSeed(_SEED)
        height, width = image.shape[:2]
        self._tracker, self._box, self._pictures = cv2.TrackerMIL.create(), box, 0
        self._tracker.init(image, _whole_pixels(box, width, height))

    def update(
        self,
        image: Image,
        shift_xy: tuple[float, float] = (0.0, 0.0),  # noqa: ARG002 - it has no use for it
    ) -> Estimate:
        """Find the target in the next picture.

        Raises
        ------
        TrackingError
            If there was no :meth:`init`.
        """
        if self._tracker is None or self._box is None:
            raise TrackingError("The tracker has no target yet: call init(image, box) first.")
        self._pictures += 1
        cv2.setRNGSeed(_SEED + self._pictures)
        found, (x, y, _, _) = self._tracker.update(image)
        if found:
            self._box = BoundingBox(float(x), float(y), self._box.width, self._box.height)
        return Estimate(self._box, self._box, apce=0.0, peak=0.0, scale=1.0)


def _whole_pixels(box: BoundingBox, width: int, height: int) -> tuple[int, int, int, int]:
    """The part of a box inside the picture, of two pixels at least."""
    left, top = min(max(round(box.x), 0), width - 2), min(max(round(box.y), 0), height - 2)
    right = min(max(round(box.right), left + 2), width)
    bottom = min(max(round(box.bottom), top + 2), height)
    return left, top, right - left, bottom - top
