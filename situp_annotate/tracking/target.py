"""One target and its model: everything of a tracker that changes from frame to frame."""

import copy
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from situp_annotate.tracking.correlation import CorrelationFilter, Model, gaussian_labels
from situp_annotate.tracking.estimate import Estimate
from situp_annotate.tracking.filters import BackgroundAwareFilter, make_filter
from situp_annotate.tracking.params import TrackerParams
from situp_annotate.tracking.response import apce, find_peak, psr
from situp_annotate.tracking.scale_filter import ScaleFilter
from situp_annotate.tracking.window import Placement, SearchWindow, search_windows
from situp_annotate.types import BoundingBox, Image

__all__ = ["Target"]

Real = npt.NDArray[np.float32]

_FUSED = (CorrelationFilter, BackgroundAwareFilter)
"""Filters with a model, that need one call for all scales."""

_KEPT_BYTES = 2**20

_PEAK_PIXELS = 5
"""Around a peak, to each side, what is no sidelobe: the window of MOSSE has eleven."""

_AS_IT_IS = (1.0, 1.0)
_WIDEST = (2.0, 2.0)
"""Beyond what the search along scales reaches, in search windows."""
_NO_MAPS = np.empty((0, 1, 1), np.float32)
_NO_MODEL = Model(np.zeros((1, 1), np.complex64), np.zeros((1, 2, 1, 1), np.float32), np.float32(0))


class Target:
    """One target and its model: everything that changes from frame to frame."""

    def __init__(self, image: Image, box: BoundingBox, params: TrackerParams) -> None:
        self._params = params
        self.shape = image.shape
        self._window = SearchWindow(image.shape, box, params)
        self._placement = self._window.first
        sigma = params.label_sigma * math.sqrt(math.prod(self._window.target_hw))
        labels = gaussian_labels(self._window.grid_hw, sigma)
        shape = self._window.spectrum_shape
        elements = self._window.plan.features.elements
        self._filter = make_filter(labels, shape, elements, self._window.target_hw, params)
        # Spectra of the windows searched last, all of them if the nearer caches can hold them.
        scales = len(params.pool)
        fused = isinstance(self._filter, _FUSED)
        self._keeps_all = not fused or 4 * scales * math.prod(shape) <= _KEPT_BYTES
        self._spectra = np.empty((scales if self._keeps_all else 1, *shape), np.float32)
        # Numbers of the windows searched last, by the steps between their samples.
        self._searched: dict[tuple[float, float], int] = {}
        self._updates = 0
        self._sums = np.zeros(2)  # of peaks and APCEs, over all updates
        self._scale_filter: ScaleFilter | None = None
        if params.scale_search == "filter":
            self._scale_filter = ScaleFilter(self._placement[2:], self._window.channels)
        self.learn(image, self._placement)

    def copy(self) -> "Target":
        """Share what stays the same, and the window's scratch; copy what changes."""
        twin = copy.copy(self)
        twin._filter, twin._spectra, twin._searched, twin._sums = (
            self._filter.copy(), np.empty_like(self._spectra), {}, self._sums.copy(),
        )  # fmt: skip
        if self._scale_filter is not None:
            twin._scale_filter = self._scale_filter.copy()
        return twin

    def update(self, image: Image, shift_xy: tuple[float, float]) -> Estimate:
        """Algorithm 1 of the paper, from the better of two places when the scene has moved."""
        before = self._placement
        self._updates += 1
        resize = self._updates % self._params.scale_interval == 0
        found, estimate = self.locate(image, resize=resize)
        moved = self._window.shifted(before, shift_xy)
        if self._window.is_elsewhere(moved, before):
            self._placement = moved
            found_moved, estimate_moved = self.locate(image, resize=resize)
            if estimate_moved.apce > estimate.apce:
                before, found, estimate = moved, found_moved, estimate_moved
            else:
                self._searched.clear()  # the spectra are those around the other place
        if not self._is_sure(estimate):
            self._placement = found
            return estimate
        known = None
        if self._keeps_all and self._scale_filter is None and found[:2] == before[:2]:
            known = self._searched.get(self._window.steps(found, _AS_IT_IS))
        if known is None:
            self.learn(image, found)
        else:
            self._placement = found
            self._filter.learn(self._spectra[known], self._params.learning_rate)
        return estimate

    def _is_sure(self, estimate: Estimate) -> bool:
        """Whether a response is high and sharp enough, beside those so far, to learn from."""
        if not self._params.learn_above:
            return True
        found = np.array([estimate.peak, estimate.apce])
        sure = bool((found * self._updates >= self._params.learn_above * self._sums).all())
        self._sums += found
        return sure

    def locate(self, image: Image, *, resize: bool = True) -> tuple[Placement, Estimate]:
        """Find the target, by the scale with the sharpest response, or of the size it has."""
        pool = self._params.pool if resize else (_AS_IT_IS,)
        responses = self._responses(image, pool)
        best = int(np.argmax([self._judge(response) for response in responses]))  # equation (14)
        found, estimate = self._estimate(pool[best], responses[best])
        if self._scale_filter is None or not resize:
            return found, estimate
        picture = self._window.prepare(image, found, (_WIDEST,))
        factor = self._scale_filter.find(picture, found[:2], found[2:])
        return self._resized(found, estimate, factor)

    def _judge(self, response: Real) -> float:
        """How much a response map speaks for its scale."""
        match self._params.scale_criterion:
            case "apce":
                return apce(response)
            case "psr":
                return psr(response, exclude=round(_PEAK_PIXELS / self._params.cell_size))
            case "max":
                return float(response.max())

    def candidates(self, image: Image) -> tuple[Estimate, ...]:
        """Find the target at each scale of the pool."""
        pairs = zip(self._params.pool, self._responses(image, self._params.pool), strict=True)
        return tuple(self._estimate(factors, map_)[1] for factors, map_ in pairs)

    def place(self, box: BoundingBox) -> None:
        """Place the target and leave the model as it is."""
        self._placement = self._window.placement(box)

    def learn(self, image: Image, where: Placement | BoundingBox) -> None:
        """Place the target and update the model there."""
        if isinstance(where, BoundingBox):
            where = self._window.placement(where)
        self._placement = where
        picture = self._window.prepare(image, where, (_AS_IT_IS,))
        self._search(picture, [self._window.steps(where, _AS_IT_IS)], self._spectra[:1], _NO_MAPS)
        self._filter.learn(self._spectra[0], self._params.learning_rate)
        if self._scale_filter is not None:
            picture = self._window.prepare(image, where, (_WIDEST,))
            self._scale_filter.learn(picture, where[:2], where[2:])

    def _responses(self, image: Image, factors: Sequence[tuple[float, float]]) -> Real:
        """Response map of each scale, (scales, rows, columns); equation (10)."""
        where = self._placement
        picture = self._window.prepare(image, where, factors)
        # Windows are whole pixels, so that scales of a small target can have the same.
        self._searched.clear()
        windows = [
            self._searched.setdefault(self._window.steps(where, factor), len(self._searched))
            for factor in factors
        ]
        if not isinstance(self._filter, _FUSED):
            self._search(picture, self._searched, self._spectra, _NO_MAPS)
            return self._filter.respond(self._spectra[: len(self._searched)])[windows]
        responses = np.empty((len(self._searched), *self._window.grid_hw), np.float32)
        self._search(picture, self._searched, self._spectra, responses)
        return responses[windows]

    def _search(
        self, picture: Image, steps: Iterable[tuple[float, float]], spectra: Real, responses: Real
    ) -> None:
        model = self._filter.model if isinstance(self._filter, _FUSED) else _NO_MODEL
        search_windows(
            picture, self._placement[:2], np.array(list(steps)), self._window.plan,
            model, spectra, responses,
        )  # fmt: skip

    def _estimate(
        self, factors_hw: tuple[float, float], response: Real
    ) -> tuple[Placement, Estimate]:
        """Where the target is if this is its scale and response map."""
        before, peak = self._placement, find_peak(response)
        step = self._params.cell_size * self._window.steps(before, factors_hw)[1]
        size = (before.height * factors_hw[0], before.width * factors_hw[1])
        found, fine = (
            Placement(before.center_y + step * y, before.center_x + step * x, *size)
            for y, x in (peak.offset_yx, peak.fine_yx)
        )
        found = fine if self._params.subcell else found
        return found, Estimate(
            box=self._window.box(found),
            fine_box=self._window.box(fine),
            apce=apce(response),
            peak=peak.value,
            scale=found.height / self._window.first.height,
        )

    def _resized(
        self, found: Placement, estimate: Estimate, factor: float
    ) -> tuple[Placement, Estimate]:
        """The same place, and another size."""
        size = {"height": found.height * factor, "width": found.width * factor}
        fine = self._window.placement(estimate.fine_box)._replace(**size)
        found = found._replace(**size)
        return found, replace(
            estimate,
            box=self._window.box(found),
            fine_box=self._window.box(fine),
            scale=found.height / self._window.first.height,
        )
