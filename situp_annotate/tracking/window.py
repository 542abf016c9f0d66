"""The search window: from a place in a picture to the spectra of the features there."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from situp_annotate.tracking.correlation import respond
from situp_annotate.tracking.features import FeaturePlan, add_colors, plan_features
from situp_annotate.tracking.fourier import TransformPlan, invert, plan_transform, transform
from situp_annotate.tracking.hog import fhog
from situp_annotate.tracking.params import TrackerParams
from situp_annotate.tracking.pyramid import PicturePyramid, Span
from situp_annotate.tracking.sampling import sample_window, sampling_steps
from situp_annotate.types import BoundingBox, Image

__all__ = ["Placement", "SearchWindow", "WindowPlan", "search_windows"]

Real = npt.NDArray[np.float32]

# Of a target's size: by how much the scene must move, and may move, to be worth a second search.
_SAME = 0.08
_OUT_OF_REACH = 3.0


class Placement(NamedTuple):
    """Where a target is: array indices, as floats, of the picture that is searched."""

    center_y: float
    center_x: float
    height: float
    width: float


class WindowPlan(NamedTuple):
    """How to get from a picture to spectra; ``window`` and ``maps`` are scratch."""

    features: FeaturePlan
    transform: TransformPlan
    window: Image
    maps: Real


@njit(cache=True, nogil=True)
def search_windows(picture, center_yx, steps_yx, plan, model, spectra, responses):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Spectra and response maps of windows around one centre.

    One call for all: it neither holds Python's lock meanwhile nor waits for it in between.

    Parameters
    ----------
    picture : Image
        From :meth:`SearchWindow.prepare`.
    center_yx : tuple of float
        Centre of the target, as array indices.
    steps_yx : ndarray of float
        (n, 2), from :meth:`SearchWindow.steps`.
    plan : WindowPlan
        Of the :class:`SearchWindow`.
    model : Model
        Of the :class:`CorrelationFilter`.
    spectra : ndarray of float32
        (n or 1, rows, 2, columns // 2 + 1, channels): gets the spectra of the features, or that
        of the last window.
    responses : ndarray of float32
        (n or 0, rows, columns): gets the response maps, equations (9) and (10), if wanted; the
        peak's place is the displacement in cells, wrapped around.
    """
    features = plan.features
    rows, columns = features.cosine_window.shape
    responses_f = np.empty((rows, 2, columns // 2 + 1, len(responses)), np.float32)
    for n in range(len(steps_yx)):
        sample_window(picture, center_yx, (steps_yx[n, 0], steps_yx[n, 1]), plan.window)
        if features.hog:
            fhog(
                plan.window, features.orientations, features.cell_size, features.cosine_window,
                plan.maps,
            )  # fmt: skip
        add_colors(plan.window, features, plan.maps)
        spectrum = spectra[n % len(spectra)]
        transform(plan.maps, plan.transform, spectrum)
        if len(responses):
            respond(spectrum, model, responses_f[:, :, :, n])
    if len(responses):
        invert(responses_f, plan.transform, responses)


class SearchWindow:
    """The window in which a target is searched, of one size in cells for good.

    Large targets are searched in a smaller picture, of which only the part below the window is
    computed.

    Parameters
    ----------
    image_shape : tuple of int
        Of all pictures: (height, width) or (height, width, 3).
    box : BoundingBox
        The target's first box.
    params : TrackerParams
        Those of the window and of the features are used.

    Attributes
    ----------
    first : Placement
        Of the first box.
    target_hw : tuple of float
        Size of the first box in cells.
    grid_hw : tuple of int
        Rows and columns of the feature maps.
    channels : int
        Of the picture that is searched: 1 or 3.
    spectrum_shape : tuple of int
        (rows, 2, columns // 2 + 1, channels), of their spectra.
    plan : WindowPlan
        How to get at their spectra.
    """

    def __init__(
        self, image_shape: tuple[int, ...], box: BoundingBox, params: TrackerParams
    ) -> None:
        self._params = params
        self._picture = PicturePyramid(image_shape, self._halvings(box), grayscale=params.grayscale)
        self.first = self._first(box)
        height, width = self._size(self.first.height, self.first.width)
        side, (least, largest) = math.sqrt(height * width), params.template_side
        enlargement = min(max(side, least), largest) / side
        # At least two cells a side, so that targets of a few pixels have a grid at all.
        self._window_hw = (
            max(math.floor(height * enlargement), 2 * params.cell_size),
            max(math.floor(width * enlargement), 2 * params.cell_size),
        )
        cells = enlargement / params.cell_size
        self.target_hw = (self.first.height * cells, self.first.width * cells)
        self.channels = channels = self._picture.channels
        features = plan_features(self._window_hw, params, color=channels == 3)
        self.grid_hw = rows, columns = features.cosine_window.shape
        self.spectrum_shape = (rows, 2, columns // 2 + 1, features.channels)
        self.plan = WindowPlan(
            features,
            plan_transform(self.grid_hw, features.channels),
            np.empty((self._window_hw[0], channels, self._window_hw[1]), np.uint8),
            np.empty((columns, rows, features.channels), np.float32),
        )

    def _halvings(self, box: BoundingBox) -> int:
        """How often pictures are halved: once for large targets, or as often as the template is."""
        halvings = int(math.sqrt(box.height * box.width) >= self._params.halve_above)
        side = math.sqrt(math.prod(self._size(box.height, box.width)))
        return max(halvings, math.floor(math.log2(side / self._params.template_side[1])))

    def _first(self, box: BoundingBox) -> Placement:
        if self._params.sampling == "plain":
            return self.placement(box)
        height, width = float(box.height), float(box.width)
        center_y, center_x = box.y + height // 2, box.x + width // 2
        pixel = self._picture.scale
        while pixel > 1:  # the authors halve and floor positions that count from 1
            center_y, center_x = (center_y + 1) // 2 - 1, (center_x + 1) // 2 - 1
            height, width, pixel = height // 2, width // 2, pixel // 2
        return Placement(center_y, center_x, height, width)

    def _size(self, height: float, width: float) -> tuple[float, float]:
        """Height and width of the window around a target of a size."""
        if self._params.window == "square":
            height = width = math.sqrt(height * width)
        return height * self._params.padding, width * self._params.padding

    def placement(self, box: BoundingBox) -> Placement:
        """Where a box is; the inverse of :meth:`box`."""
        center = self._picture.down(box.y + box.height / 2, box.x + box.width / 2)
        return Placement(*center, box.height / self._picture.scale, box.width / self._picture.scale)

    def shifted(self, placement: Placement, shift_xy: tuple[float, float]) -> Placement:
        """Where a target is when the scene has taken it along by this many pixels."""
        return placement._replace(
            center_y=placement.center_y + shift_xy[1] / self._picture.scale,
            center_x=placement.center_x + shift_xy[0] / self._picture.scale,
        )

    def is_elsewhere(self, placement: Placement, other: Placement) -> bool:
        """Whether it is worth searching at both: neither the same place nor out of all reach."""
        away = max(
            abs(placement.center_y - other.center_y) / other.height,
            abs(placement.center_x - other.center_x) / other.width,
        )
        return _SAME < away < _OUT_OF_REACH

    def box(self, placement: Placement) -> BoundingBox:
        """Return the box of a placement, in pixels of the picture as it is."""
        center_y, center_x = self._picture.up(placement.center_y, placement.center_x)
        height, width = (self._picture.scale * size for size in placement[2:])
        return BoundingBox(center_x - width / 2, center_y - height / 2, width, height)

    def prepare(
        self, image: Image, placement: Placement, factors: Iterable[tuple[float, float]]
    ) -> Image:
        """Make the picture that is searched, as far as it lies below the windows at factors."""
        if self._picture.is_given:
            return self._picture.search(image, None)
        span: list[int] = []
        steps = [self.steps(placement, factor) for factor in factors]
        for axis, center in enumerate((placement.center_y, placement.center_x)):
            reach = max(step[axis] for step in steps) * (self._window_hw[axis] / 2 + 1) + 2
            size = self._picture.shape_hw[axis]
            start = min(max(math.floor(center - reach), 0), size - 1)
            span += [start, min(max(math.ceil(center + reach), start + 1), size)]
        return self._picture.search(image, Span(*span))

    def steps(self, placement: Placement, factors_hw: tuple[float, float]) -> tuple[float, float]:
        """Pixels between neighbouring samples at a scale, along rows and columns."""
        size_hw = self._size(placement.height, placement.width)
        plain = self._params.sampling == "plain"
        return sampling_steps(size_hw, factors_hw, self._window_hw, plain=plain)
