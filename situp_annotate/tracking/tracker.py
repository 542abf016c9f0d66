"""The SITUP tracker: one target, frame by frame.

References
----------
H. Ma, S. T. Acton, Z. Lin, SITUP: Scale invariant tracking using average peak-to-correlation
energy. Equation numbers are that paper's. Where it is silent, the authors' published code
decides; the places are named in the modules of this package.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from situp_annotate.errors import TrackingError
from situp_annotate.tracking import correlation
from situp_annotate.tracking.features import FeatureExtractor
from situp_annotate.tracking.params import TrackerParams
from situp_annotate.tracking.resizing import Resizer
from situp_annotate.tracking.response import apce, find_peak
from situp_annotate.tracking.sampling import as_channels, sample_windows
from situp_annotate.types import BoundingBox, Image

__all__ = ["Estimate", "SitupTracker", "Tracker"]


@dataclass(frozen=True, slots=True)
class Estimate:
    """Where a tracker believes its target to be.

    Attributes
    ----------
    box : BoundingBox
        In pixels of the picture; always finite, possibly outside the picture.
    apce : float
        Average peak-to-correlation energy of the winning response map, equation (13); ≥ 0.
    peak : float
        Highest value of that map; about 1 for a perfect match, small when the target is gone.
    scale : float
        Size of the box over the size of the first box; greater than 0.
    """

    box: BoundingBox
    apce: float
    peak: float
    scale: float


class Tracker(Protocol):
    """What every tracker offers."""

    def init(self, image: Image, box: BoundingBox) -> None:
        """Learn the target from its box in a first picture; forget any target before."""

    def update(self, image: Image) -> Estimate:
        """Find the target in the next picture, of the same size and kind as the first."""


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

    def update(self, image: Image) -> Estimate:
        """Find the target in the next picture and learn from what is found.

        Parameters
        ----------
        image : Image
            Of the same shape as the picture given to :meth:`init`.

        Raises
        ------
        TrackingError
            If there was no :meth:`init`, or the picture is of another kind or shape.
        """
        if self._target is None:
            raise TrackingError("The tracker has no target yet: call init(image, box) first.")
        _check_image(image)
        return self._target.update(image)


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
    """One target and its model: everything that changes from frame to frame.

    Works in array indices of the picture, or of the picture at half size for large targets.
    """

    def __init__(self, image: Image, box: BoundingBox, params: TrackerParams) -> None:
        self._params = params
        self._shape = image.shape
        size = np.array([box.height, box.width])
        center = np.array([box.y, box.x]) + np.floor(size / 2)
        self._halve: Resizer | None = None
        if math.sqrt(size.prod()) >= params.halve_above:
            height, width = image.shape[:2]
            self._halve = Resizer((height, width), ((height + 1) // 2, (width + 1) // 2))
            # The authors halve and floor positions that count from 1.
            center = np.floor((center + 1) / 2) - 1
            size = np.floor(size / 2)
        self._center_yx, self._size_hw, self._first_size_hw = center, size, size
        # At least two cells a side, so that targets of a few pixels have a grid at all.
        window = np.maximum(np.floor(size * params.padding), 2 * params.cell_size).astype(int)
        self._window_hw = (int(window[0]), int(window[1]))
        self._extract = FeatureExtractor(self._window_hw, color=image.ndim == 3, params=params)
        self._columns = self._extract.grid_hw[1]
        sigma = params.label_sigma * math.sqrt(size.prod()) / params.cell_size
        labels = correlation.gaussian_labels(self._extract.grid_hw, sigma)
        self._labels_f = correlation.spectrum(labels)
        self._alpha_f, self._template_f = self._learn(self._prepare(image))

    def update(self, image: Image) -> Estimate:
        """Algorithm 1 of the paper."""
        if image.shape != self._shape:
            raise TrackingError(
                f"The picture has shape {image.shape}, the one the target was learnt from "
                f"{self._shape}: all must be the same."
            )
        picture = self._prepare(image)
        responses = correlation.respond(
            self._alpha_f,
            self._template_f,
            self._spectra(picture, self._params.scale_factors),
            self._columns,
        )
        sharpness = [apce(response) for response in responses]
        best = int(np.argmax(sharpness))  # equation (14)
        peak = find_peak(responses[best])
        factor = self._params.scale_factors[best]
        sampled_width = math.floor(self._size_hw[1] * self._params.padding * factor)
        pixels_per_cell = self._params.cell_size * sampled_width / self._window_hw[1]
        self._center_yx = self._center_yx + pixels_per_cell * np.array(peak.offset_yx)
        self._size_hw = self._size_hw * factor
        alpha_f, template_f = self._learn(picture)
        rate = self._params.learning_rate
        self._alpha_f = correlation.interpolate(self._alpha_f, alpha_f, rate)
        self._template_f = correlation.interpolate(self._template_f, template_f, rate)
        return Estimate(
            box=self._box(),
            apce=sharpness[best],
            peak=peak.value,
            scale=float(self._size_hw[0] / self._first_size_hw[0]),
        )

    def _prepare(self, image: Image) -> Image:
        """Picture with a channel axis, at half size for large targets."""
        picture = as_channels(image)
        if self._halve is not None:
            picture = self._halve(picture[np.newaxis])[0]
        return picture

    def _spectra(self, picture: Image, factors: tuple[float, ...]) -> correlation.Complex:
        """Spectra of the features of the windows at each scale, around the present state."""
        windows = sample_windows(
            picture,
            (float(self._center_yx[0]), float(self._center_yx[1])),
            (self._size_hw[0] * self._params.padding, self._size_hw[1] * self._params.padding),
            factors,
            self._window_hw,
        )
        return correlation.spectrum(self._extract(windows))

    def _learn(self, picture: Image) -> tuple[correlation.Complex, correlation.Complex]:
        """Dual coefficients and template of the present state alone."""
        (template_f,) = self._spectra(picture, (1.0,))
        alpha_f = correlation.train(
            template_f, self._labels_f, self._columns, self._params.regularization
        )
        return alpha_f, template_f

    def _box(self) -> BoundingBox:
        corner, size = self._center_yx - self._size_hw / 2, self._size_hw
        if self._halve is not None:
            corner, size = 2 * corner + 1, 2 * size
        return BoundingBox(float(corner[1]), float(corner[0]), float(size[1]), float(size[0]))
