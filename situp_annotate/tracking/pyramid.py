"""The picture that is searched: the given one, in grey or at half its size again and again."""

from typing import NamedTuple

import numpy as np

from situp_annotate.tracking.features import turn_grey
from situp_annotate.tracking.resizing import halve
from situp_annotate.types import Image

__all__ = ["PicturePyramid", "Span"]

_REACH = 8
"""Pixels around a part of a picture that may shape that part at half size."""


class Span(NamedTuple):
    """Part of a picture: first row and the one after the last, and columns likewise."""

    top: int
    bottom: int
    left: int
    right: int


def _read_only(picture: Image) -> Image:
    """View of a picture, always of one kind: kernels are compiled for each kind of array."""
    view = np.ascontiguousarray(picture).view()
    view.setflags(write=False)
    return view


def _with_channels(image: Image) -> Image:
    return _read_only(image if image.ndim == 3 else image[:, :, np.newaxis])


class PicturePyramid:
    """Makes the picture that is searched, as far as it is needed.

    Parameters
    ----------
    image_shape : tuple of int
        Of all pictures: (height, width) or (height, width, 3).
    halvings : int
        How often pictures are halved; at least 0.
    grayscale : bool
        Whether colour pictures are turned grey first.

    Attributes
    ----------
    shape_hw : tuple of int
        Of the picture that is searched.
    channels : int
        Of it: 1 or 3.
    """

    def __init__(self, image_shape: tuple[int, ...], halvings: int, *, grayscale: bool) -> None:
        channels = image_shape[2] if len(image_shape) == 3 else 1
        self._turns_grey = grayscale and channels > 1
        self.channels = 1 if self._turns_grey else channels
        shapes = [(image_shape[0], image_shape[1])]
        for _ in range(halvings):
            shapes.append(((shapes[-1][0] + 1) // 2, (shapes[-1][1] + 1) // 2))
        self.shape_hw = shapes[-1]
        self._grey = np.empty((*(shapes[0] if self._turns_grey else (0, 0)), 1), np.uint8)
        self._halves = [np.empty((*shape, self.channels), np.uint8) for shape in shapes[1:]]

    @property
    def is_given(self) -> bool:
        """Whether what is searched is the given picture, of which nothing need be computed."""
        return not (self._halves or self._turns_grey)

    @property
    def scale(self) -> int:
        """How many times as large the given pictures are, each side."""
        return int(2 ** len(self._halves))

    def down(self, y: float, x: float) -> tuple[float, float]:
        """Where a place of the given picture is in the one that is searched; array indices."""
        for _ in self._halves:
            y, x = (y - 1) / 2, (x - 1) / 2
        return y, x

    def up(self, y: float, x: float) -> tuple[float, float]:
        """The inverse of :meth:`down`."""
        for _ in self._halves:
            y, x = 2 * y + 1, 2 * x + 1
        return y, x

    def search(self, image: Image, span: Span | None) -> Image:
        """The picture that is searched, with a channel axis.

        Parameters
        ----------
        image : Image
            Of the shape given at first.
        span : Span or None
            Part of the picture that is searched, within it; the rest may be anything. Not needed
            where it is the given one.
        """
        if span is None:
            return _with_channels(image)
        spans = [span]
        for larger in (*reversed(self._halves[:-1]), image)[: len(self._halves)]:
            spans.insert(0, _below(spans[0], larger.shape))
        picture = _with_channels(image)
        if self._turns_grey:
            turn_grey(picture, spans[0], self._grey)
            picture = _read_only(self._grey)
        for part, half in zip(spans[1:], self._halves, strict=True):
            halve(picture, part, half)
            picture = _read_only(half)
        return picture


def _below(span: Span, shape: tuple[int, ...]) -> Span:
    """What shapes a part of a picture of half size."""
    return Span(
        max(2 * span.top - _REACH, 0),
        min(2 * span.bottom + _REACH, shape[0]),
        max(2 * span.left - _REACH, 0),
        min(2 * span.right + _REACH, shape[1]),
    )
