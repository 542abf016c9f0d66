"""Cut a box and what is around it out of a picture, always in the same size."""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np

from situp_annotate.formats.overlay.text import Color
from situp_annotate.types import BoundingBox, Image

__all__ = ["View"]


@dataclass(frozen=True, slots=True)
class View:
    """A part of a picture, which may reach beyond it.

    Attributes
    ----------
    left, top : float
        Its corner in the picture.
    scale : float
        Pixels it is shown with, per pixel of the picture.
    size_hw : tuple of int
        Height and width it is shown with.
    """

    left: float
    top: float
    scale: float
    size_hw: tuple[int, int]

    @classmethod
    def around(
        cls, box: BoundingBox, size_hw: tuple[int, int], *, share: float, smallest: float
    ) -> Self:
        """Look at a box.

        Parameters
        ----------
        box : BoundingBox
            Is in the middle.
        size_hw : tuple of int
            Height and width to show it with.
        share : float
            Side of what is shown over the side of the box, in the tighter direction.
        smallest : float
            Width in pixels of the picture that is shown at least.
        """
        height, width = size_hw
        shown = max(share * box.width, share * box.height * width / height, smallest)
        scale = width / shown
        left = box.x + box.width / 2 - shown / 2
        return cls(left, box.y + box.height / 2 - height / scale / 2, scale, size_hw)

    def place(self, box: BoundingBox) -> BoundingBox:
        """Where a box of the picture is in what `cut_out` gives."""
        return BoundingBox(
            (box.x - self.left) * self.scale,
            (box.y - self.top) * self.scale,
            box.width * self.scale,
            box.height * self.scale,
        )

    def cut_out(self, image: Image, background: Color) -> Image:
        """The part of a picture in view, (height, width, 3), on a colour beyond its edges.

        Parameters
        ----------
        image : Image
            (h, w), or (h, w, 3) in the order B, G, R; not changed.
        background : tuple of int
            Likewise B, G, R.
        """
        height, width = self.size_hw
        canvas = np.full((height, width, 3), background, np.uint8)
        right, bottom = self.left + width / self.scale, self.top + height / self.scale
        first_x, first_y = max(int(self.left), 0), max(int(self.top), 0)
        part = image[first_y : max(int(bottom) + 1, 0), first_x : max(int(right) + 1, 0)]
        if not part.size or right <= 0 or bottom <= 0:
            return canvas
        size = (max(round(side * self.scale), 1) for side in part.shape[1::-1])
        small = cv2.resize(part, tuple(size), interpolation=cv2.INTER_AREA)
        if small.ndim == 2:
            small = cv2.cvtColor(small, cv2.COLOR_GRAY2BGR)
        x, y = round((first_x - self.left) * self.scale), round((first_y - self.top) * self.scale)
        small = small[max(-y, 0) :, max(-x, 0) :]
        area = canvas[max(y, 0) :, max(x, 0) :][: small.shape[0], : small.shape[1]]
        area[:] = small[: area.shape[0], : area.shape[1]]
        return canvas
