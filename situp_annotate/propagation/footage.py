"""What propagation reads: pictures that can be walked through in both directions."""

from collections.abc import Iterator, Sequence
from typing import Protocol

from situp_annotate.types import Frame

__all__ = ["Footage", "FramesInMemory"]


class Footage(Protocol):
    """A video that can be read more than once."""

    @property
    def size_hw(self) -> tuple[int, int]:
        """Height and width of the pictures in pixels."""

    def forward(self) -> Iterator[Frame]:
        """All frames, in order."""

    def backward(self, start: int, stop: int) -> Iterator[Frame]:
        """The frames ``stop - 1``, ``stop - 2``, … down to `start`; after a walk forward only."""


class FramesInMemory:
    """Footage that is at hand already: for short stretches, experiments and tests.

    Parameters
    ----------
    frames : sequence of Frame
        From index 0 on, without gaps; at least one.
    """

    def __init__(self, frames: Sequence[Frame]) -> None:
        self._frames = frames

    @property
    def size_hw(self) -> tuple[int, int]:
        """Height and width of the pictures in pixels."""
        height, width = self._frames[0].image.shape[:2]
        return height, width

    def forward(self) -> Iterator[Frame]:
        """All frames, in order."""
        return iter(self._frames)

    def backward(self, start: int, stop: int) -> Iterator[Frame]:
        """The frames ``stop - 1``, ``stop - 2``, … down to `start`."""
        return (self._frames[index] for index in range(stop - 1, start - 1, -1))
