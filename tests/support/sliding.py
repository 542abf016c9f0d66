"""A tracker whose every answer is known, and footage for it."""

from dataclasses import dataclass, field

import numpy as np

from situp_annotate.propagation import FramesInMemory
from situp_annotate.tracking import Estimate
from situp_annotate.types import BoundingBox, Frame

BOX = BoundingBox(10, 20, 8, 9)
OTHER = BoundingBox(30, 5, 6, 7)


class Sliding:
    """Says that the target moves by one pixel a frame to the right, in whichever direction."""

    starts = 0

    def init(self, image, box):
        type(self).starts += 1
        self.box, self.age = box, 0

    def update(self, image, shift_xy=(0.0, 0.0)):
        self.age += 1
        box = BoundingBox(self.box.x + self.age, self.box.y, self.box.width, self.box.height)
        return Estimate(box, box, apce=40.0 / self.age, peak=0.5, scale=1.0)


class Still(Sliding):
    """Says that the target does not move."""

    def update(self, image, shift_xy=(0.0, 0.0)):
        return Estimate(self.box, self.box, apce=40.0, peak=0.5, scale=1.0)


@dataclass
class Recorded:
    """Footage that notes what was read of it."""

    frames: list
    read: list = field(default_factory=list)

    @property
    def size_hw(self):
        return self.frames[0].image.shape[:2]

    def forward(self):
        for frame in self.frames:
            self.read.append(frame.index)
            yield frame

    def backward(self, start, stop):
        for frame in FramesInMemory(self.frames).backward(start, stop):
            self.read.append(-frame.index)
            yield frame


def footage(count, size=(50, 60)):
    return Recorded(
        [Frame(index, index * 40_000_000, np.zeros(size, np.uint8)) for index in range(count)]
    )
