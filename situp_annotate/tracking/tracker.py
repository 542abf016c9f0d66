"""The SITUP tracker: one target, frame by frame.

References
----------
H. Ma, S. T. Acton, Z. Lin, SITUP: Scale invariant tracking using average peak-to-correlation
energy. Equation numbers are that paper's. Where it is silent, the authors' published code
decides; the places are named in the modules of this package.
"""

import copy
from typing import Protocol

import numpy as np

from situp_annotate.errors import TrackingError
from situp_annotate.tracking.estimate import Estimate
from situp_annotate.tracking.params import TrackerParams
from situp_annotate.tracking.target import Target
from situp_annotate.types import BoundingBox, Image

__all__ = ["SitupTracker", "Tracker"]


class Tracker(Protocol):
    """What every tracker offers."""

    def init(self, image: Image, box: BoundingBox) -> None:
        """Learn the target from its box in a first picture; forget any target before."""

    def update(self, image: Image, shift_xy: tuple[float, float] = (0.0, 0.0)) -> Estimate:
        """Find the target in the next picture, of the same size and kind as the first.

        ``shift_xy`` is how far the scene has moved since the picture before, in pixels.
        """


class SitupTracker:
    """Correlation filter with a pool of scales, the sharpest response of which wins.

    With other parameters it is one of its relatives; :mod:`situp_annotate.trackers` has those that
    were published.

    Parameters
    ----------
    params : TrackerParams, optional
        Defaults to the paper's.

    Examples
    --------
    >>> import numpy as np
    >>> from situp_annotate import BoundingBox, SitupTracker
    >>> noise = np.random.default_rng(0).integers(0, 256, (120, 160), dtype=np.uint8)
    >>> tracker = SitupTracker()
    >>> tracker.init(noise, BoundingBox(60, 40, 32, 32))
    >>> estimate = tracker.update(np.roll(noise, 4, axis=1))
    >>> estimate.box
    BoundingBox(x=64.0, y=40.0, width=32.0, height=32.0)
    """

    def __init__(self, params: TrackerParams | None = None) -> None:
        self._params = params or TrackerParams()
        self._target: Target | None = None

    def init(self, image: Image, box: BoundingBox) -> None:
        """Learn the target from its box in a first picture; forget any target before.

        Parameters
        ----------
        image : Image
            uint8, (height, width) grey or (height, width, 3) in the order B, G, R.
        box : BoundingBox
            May reach beyond the picture.

        Raises
        ------
        TrackingError
            If the picture is not of that kind.
        """
        _check_image(image)
        self._target = Target(image, box, self._params)

    def update(self, image: Image, shift_xy: tuple[float, float] = (0.0, 0.0)) -> Estimate:
        """Find the target in the next picture and learn from what is found.

        Parameters
        ----------
        image : Image
            Of the same shape as the picture given to :meth:`init`.
        shift_xy : tuple of float
            How far the scene has moved since the picture before, in pixels, as the camera turned
            or shook. The target is then searched both where it was and where the scene would
            have taken it; the sharper response wins. Not in the paper; zero is the paper's tracker.

        Raises
        ------
        TrackingError
            If there was no :meth:`init`, or the picture is of another kind or shape.
        """
        return self._target_for(image).update(image, shift_xy)

    def locate(self, image: Image) -> Estimate:
        """Find the target in a picture, but stay where it was and learn nothing.

        Parameters and errors are those of :meth:`update`.
        """
        return self._target_for(image).locate(image)[1]

    def candidates(self, image: Image) -> tuple[Estimate, ...]:
        """Find the target at each scale of the pool, in its order; change nothing.

        :meth:`locate` gives the one with the highest APCE. Parameters and errors are those of
        :meth:`update`.
        """
        return self._target_for(image).candidates(image)

    def place(self, box: BoundingBox) -> None:
        """Go to where the target may be, and learn nothing; :meth:`locate` searches there.

        Raises
        ------
        TrackingError
            If there was no :meth:`init`.
        """
        self._initialised().place(box)

    def learn(self, image: Image, box: BoundingBox) -> None:
        """Go to where the target is known to be in a picture, and learn from there.

        Parameters
        ----------
        image : Image
            Of the same shape as the picture given to :meth:`init`.
        box : BoundingBox
            May reach beyond the picture; its size is the target's from now on.

        Raises
        ------
        TrackingError
            As :meth:`update`.
        """
        self._target_for(image).learn(image, box)

    def copy(self) -> "SitupTracker":
        """A tracker of the same target that goes its own way, in the same thread only."""
        twin = copy.copy(self)
        twin._target = self._initialised().copy()
        return twin

    def _initialised(self) -> "Target":
        if self._target is None:
            raise TrackingError("The tracker has no target yet: call init(image, box) first.")
        return self._target

    def _target_for(self, image: Image) -> "Target":
        target = self._initialised()
        _check_image(image)
        if image.shape != target.shape:
            raise TrackingError(
                f"The picture has shape {image.shape}, the one the target was learnt from "
                f"{target.shape}: all must be the same."
            )
        return target


def _check_image(image: object) -> None:
    if isinstance(image, np.ndarray):
        grey, color = image.ndim == 2, image.ndim == 3 and image.shape[-1] == 3
        if image.dtype == np.uint8 and image.size > 0 and (grey or color):
            return
        found = f"{image.dtype} {image.shape}"
    else:
        found = type(image).__name__
    raise TrackingError(
        "A picture must be a uint8 array of shape (height, width) or (height, width, 3), "
        f"not {found}."
    )
