"""The least that a tracker has to offer: any object with these two methods will do."""

import cv2

from situp_annotate import BoundingBox
from situp_annotate.tracking import Estimate
from situp_annotate.types import Image


class TemplateTracker:
    """Finds the place in each picture that looks most as the target did in the first."""

    def init(self, image: Image, box: BoundingBox) -> None:
        """Called once, with the first picture (uint8, grey or B, G, R) and the target's box."""
        x, y = max(round(box.x), 0), max(round(box.y), 0)
        self._box = box
        self._offset_xy = (box.x - x, box.y - y)
        self._template = image[y : round(box.bottom), x : round(box.right)].copy()

    def update(self, image: Image, shift_xy: tuple[float, float] = (0.0, 0.0)) -> Estimate:  # noqa: ARG002
        """Called with each further picture; says where the target is now."""
        match = cv2.matchTemplate(image, self._template, cv2.TM_CCOEFF_NORMED)
        _, peak, _, (x, y) = cv2.minMaxLoc(match)
        box = BoundingBox(
            x + self._offset_xy[0], y + self._offset_xy[1], self._box.width, self._box.height
        )
        return Estimate(box, box, apce=0.0, peak=peak, scale=1.0)
