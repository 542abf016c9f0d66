"""The SITUP tracker: one target, frame by frame.

References
----------
H. Ma, S. T. Acton, Z. Lin, SITUP: Scale invariant tracking using average peak-to-correlation
energy. Equation numbers are that paper's. Where it is silent, the authors' published code
decides; the places are named in the modules of this package.
"""

import copy
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from situp_annotate.errors import TrackingError
from situp_annotate.tracking.correlation import CorrelationFilter, gaussian_labels
from situp_annotate.tracking.params import TrackerParams
from situp_annotate.tracking.response import apce, find_peak
from situp_annotate.tracking.window import Placement, SearchWindow, search_windows
from situp_annotate.types import BoundingBox, Image

__all__ = ["Estimate", "SitupTracker", "Tracker"]

Real = npt.NDArray[np.float32]

_KEPT_BYTES = 2**20


@dataclass(frozen=True, slots=True)
class Estimate:
    """Where a tracker believes its target to be.

    Attributes
    ----------
    box : BoundingBox
        In pixels of the picture; always finite, possibly outside the picture. SITUP moves it by
        whole feature cells.
    fine_box : BoundingBox
        The same box where the response peaks between the cells: nearer to the target, but not
        what the paper's tracker goes on from.
    apce : float
        Average peak-to-correlation energy of the winning response map, equation (13); ≥ 0.
    peak : float
        Highest value of that map; about 1 for a perfect match, small when the target is gone.
    scale : float
        Size of the box over the size of the first box; greater than 0.
    """

    box: BoundingBox
    fine_box: BoundingBox
    apce: float
    peak: float
    scale: float


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
        self._target: _Target | None = None

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
        self._target = _Target(image, box, self._params)

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

    def _initialised(self) -> "_Target":
        if self._target is None:
            raise TrackingError("The tracker has no target yet: call init(image, box) first.")
        return self._target

    def _target_for(self, image: Image) -> "_Target":
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


class _Target:
    """One target and its model: everything that changes from frame to frame."""

    def __init__(self, image: Image, box: BoundingBox, params: TrackerParams) -> None:
        self._params = params
        self.shape = image.shape
        self._window = SearchWindow(image.shape, box, params)
        self._placement = self._window.first
        sigma = params.label_sigma * math.sqrt(self._placement.height * self._placement.width)
        labels = gaussian_labels(self._window.grid_hw, sigma / params.cell_size)
        shape = self._window.spectrum_shape
        self._filter = CorrelationFilter(
            labels, shape, self._window.plan.features.elements, params.regularization
        )
        # Spectra of the windows searched last, all of them if the nearer caches can hold them.
        scales = len(params.scale_factors)
        self._keeps_all = 4 * scales * math.prod(shape) <= _KEPT_BYTES
        self._spectra = np.empty((scales if self._keeps_all else 1, *shape), np.float32)
        # Numbers of the windows searched last, by the steps between their samples.
        self._searched: dict[tuple[float, float], int] = {}
        self.learn(image, self._placement)

    def copy(self) -> "_Target":
        """Share what stays the same, and the window's scratch; copy what changes."""
        twin = copy.copy(self)
        twin._filter, twin._spectra, twin._searched = (
            self._filter.copy(), np.empty_like(self._spectra), {},
        )  # fmt: skip
        return twin

    def update(self, image: Image, shift_xy: tuple[float, float]) -> Estimate:
        """Algorithm 1 of the paper, from the better of two places when the scene has moved."""
        before = self._placement
        found, estimate = self.locate(image)
        moved = self._window.shifted(before, shift_xy)
        if self._window.is_elsewhere(moved, before):
            self._placement = moved
            found_moved, estimate_moved = self.locate(image)
            if estimate_moved.apce > estimate.apce:
                before, found, estimate = moved, found_moved, estimate_moved
            else:
                self._searched.clear()  # the spectra are those around the other place
        known = None
        if self._keeps_all and found[:2] == before[:2]:
            known = self._searched.get(self._window.steps(found, 1.0))
        if known is None:
            self.learn(image, found)
        else:
            self._placement = found
            self._filter.learn(self._spectra[known], self._params.learning_rate)
        return estimate

    def locate(self, image: Image) -> tuple[Placement, Estimate]:
        """Find the target, by the scale with the sharpest response."""
        responses = self._responses(image)
        sharpness = [apce(response) for response in responses]
        best = int(np.argmax(sharpness))  # equation (14)
        return self._estimate(self._params.scale_factors[best], responses[best], sharpness[best])

    def candidates(self, image: Image) -> tuple[Estimate, ...]:
        """Find the target at each scale of the pool."""
        pairs = zip(self._params.scale_factors, self._responses(image), strict=True)
        return tuple(self._estimate(factor, map_, apce(map_))[1] for factor, map_ in pairs)

    def place(self, box: BoundingBox) -> None:
        """Place the target and leave the model as it is."""
        self._placement = self._window.placement(box)

    def learn(self, image: Image, where: Placement | BoundingBox) -> None:
        """Place the target and update the model there."""
        if isinstance(where, BoundingBox):
            where = self._window.placement(where)
        self._placement = where
        picture = self._window.prepare(image, where, (1.0,))
        steps = [self._window.steps(where, 1.0)]
        self._search(picture, steps, self._spectra[:1], np.empty((0, 1, 1), np.float32))
        self._filter.learn(self._spectra[0], self._params.learning_rate)

    def _responses(self, image: Image) -> Real:
        """Response map of each scale of the pool, (scales, rows, columns); equation (10)."""
        factors, where = self._params.scale_factors, self._placement
        picture = self._window.prepare(image, where, factors)
        # Windows are whole pixels, so that scales of a small target can have the same.
        self._searched.clear()
        windows = [
            self._searched.setdefault(self._window.steps(where, factor), len(self._searched))
            for factor in factors
        ]
        responses = np.empty((len(self._searched), *self._window.grid_hw), np.float32)
        self._search(picture, self._searched, self._spectra, responses)
        return responses[windows]

    def _search(
        self, picture: Image, steps: Iterable[tuple[float, float]], spectra: Real, responses: Real
    ) -> None:
        search_windows(
            picture, self._placement[:2], np.array(list(steps)), self._window.plan,
            self._filter.model, spectra, responses,
        )  # fmt: skip

    def _estimate(
        self, factor: float, response: Real, sharpness: float
    ) -> tuple[Placement, Estimate]:
        """Where the target is if this is its scale and response map."""
        before, peak = self._placement, find_peak(response)
        step = self._params.cell_size * self._window.steps(before, factor)[1]
        size = (before.height * factor, before.width * factor)
        found, fine = (
            Placement(before.center_y + step * y, before.center_x + step * x, *size)
            for y, x in (peak.offset_yx, peak.fine_yx)
        )
        return found, Estimate(
            box=self._window.box(found),
            fine_box=self._window.box(fine),
            apce=sharpness,
            peak=peak.value,
            scale=found.height / self._window.first.height,
        )
