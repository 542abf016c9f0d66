"""The numbers of the tracker, each with the paper's symbol and where it comes from."""

import math
from dataclasses import dataclass, fields
from typing import Literal

from situp_annotate.errors import TrackingError

__all__ = ["TrackerParams"]


@dataclass(frozen=True, slots=True)
class TrackerParams:
    """Settings of :class:`~situp_annotate.tracking.SitupTracker`; the defaults are the paper's.

    Attributes
    ----------
    padding : float
        Search window over target size, each side; at least 1. §IV-A gives the padding ratio 1.5,
        what is added, which makes 2.5; the authors' code has both forms.
    window : {"target", "square"}
        Whether the search window has the target's shape, or is a square of the same area.
    template_side : tuple of float
        Least and largest side (square root of the area, pixels) that the template may have; windows
        are brought to it, in a picture that is halved as often as fits. Not in the paper, which
        leaves them as they are.
    cell_size : int
        Side of a feature cell in pixels of the window; at least 2, or 1 without HOG. Not in the
        paper; 4 in the authors' code, which also moves by whole cells.
    label_sigma : float
        Standard deviation of the regression target **y**, equation (2), over the square root of
        the target's area; greater than 0. §IV-A: a tenth of the target size. The authors' code
        divides by the cell size, as here.
    regularization : float
        λ of the ridge regression, equations (2) and (7); greater than 0. §IV-A: 0.0003. The
        authors' code divides kernels by their number of elements, so that it fits all sizes.
    learning_rate : float
        θ of the model update, equation (11); in [0, 1], 0 keeps the first frame's model. §IV-A:
        0.004. The authors' code updates in every frame, α̂ and the template alike.
    learn_above : float
        Share of their means over the frames so far that a response's peak and APCE must both reach
        for the model to be updated, as in LMCF; in [0, 1], 0 is the paper's.
    scale_factors : tuple of float
        The pool **S** of scales t, equation (14); 1 to 32 numbers from 0.5 to 2, ``(1.0,)`` turns
        the search for scale off. §IV-A, in the authors' order: of equal APCEs the first wins.
    scale_criterion : {"apce", "max", "psr"}
        By which the response maps of the pool are compared: equation (13); the naive maximum, as
        SAMF does; or the peak-to-sidelobe ratio of MOSSE.
    scale_interval : int
        In every how many-th frame scales are searched; at least 1, which is the paper's.
    scale_search : {"pool", "filter"}
        Whether the size comes from the pool, or from a filter along scales once the place is
        known, as in DSST; the pool is then that of the place alone.
    aspect_factors : tuple of float
        Ratios of height to width, relative to the target's, at which each scale is tried; numbers
        from 0.5 to 2. Not in the paper.
    features : tuple of {"hog", "gray", "color"}
        Channels that the filter sees; at least one of the first two. §III-B: all three.
    grayscale : bool
        Whether colour pictures are turned grey first, as by KCF.
    kernel : {"linear", "gaussian"}
        Of the ridge regression. §III-B: linear, as in DCF; Gaussian as in KCF.
    kernel_sigma : float
        Standard deviation of the Gaussian kernel; greater than 0.
    filter : {"dual", "ratio", "background"}
        Whether the dual coefficients and the template are averaged over frames, equation (11);
        or, with a linear kernel, numerator and denominator of the filter, as MOSSE and DSST do; or
        the features, for which then a filter is found that is zero beyond the target, as in BACF.
    support : float
        Height and width over the target's within which the background-aware filter may differ from
        zero; greater than 0.
    sampling : {"authors", "plain"}
        How windows are sampled. The authors' code floors a first box that it halves, and steps
        from row to row by the product of both axes' ratios, as SAMF's does; plainly, a target that
        grows keeps its shape.
    subcell : bool
        Whether the target moves to where the response peaks between the cells.
    halve_above : float
        Targets of this size (square root of the area, pixels) or more are tracked in the picture
        of half size; greater than 0. Not in the paper; 100 in the authors' code.
    color_table : str or None
        Path of a colour-name table to use in place of the built-in model; see
        :func:`situp_annotate.tracking.color_names.load_table`. The authors' code uses the table of
        van de Weijer et al.

    Raises
    ------
    TrackingError
        If a value is out of its range.
    """

    padding: float = 2.5
    window: Literal["target", "square"] = "target"
    template_side: tuple[float, float] = (0.0, 1e9)
    cell_size: int = 4
    label_sigma: float = 0.1
    regularization: float = 3e-4
    learning_rate: float = 0.004
    learn_above: float = 0.0
    scale_factors: tuple[float, ...] = (1.0, 0.995, 1.005, 0.985, 0.99, 1.01, 1.015)
    scale_criterion: Literal["apce", "max", "psr"] = "apce"
    features: tuple[Literal["hog", "gray", "color"], ...] = ("hog", "gray", "color")
    grayscale: bool = False
    scale_interval: int = 1
    scale_search: Literal["pool", "filter"] = "pool"
    aspect_factors: tuple[float, ...] = (1.0,)
    kernel: Literal["linear", "gaussian"] = "linear"
    kernel_sigma: float = 0.5
    filter: Literal["dual", "ratio", "background"] = "dual"
    support: float = 1.0
    sampling: Literal["authors", "plain"] = "authors"
    subcell: bool = False
    halve_above: float = 100.0
    color_table: str | None = None

    def __post_init__(self) -> None:
        allowed = {
            "padding": (self.padding >= 1, "at least 1"),
            "cell_size": (
                self.cell_size >= (2 if "hog" in self.features else 1),
                "at least 2, or 1 without HOG",
            ),
            "features": (bool({"hog", "gray"} & {*self.features}), "some of hog, gray and color"),
            "kernel_sigma": (self.kernel_sigma > 0, "greater than 0"),
            "filter": (
                self.filter == "dual" or self.kernel == "linear",
                "dual for a Gaussian kernel",
            ),
            "template_side": (
                0 <= self.template_side[0] <= self.template_side[1] > 0,
                "two numbers from 0, the second greater than 0 and not below the first",
            ),
            "support": (self.support > 0, "greater than 0"),
            "label_sigma": (self.label_sigma > 0, "greater than 0"),
            "regularization": (self.regularization > 0, "greater than 0"),
            "learning_rate": (0 <= self.learning_rate <= 1, "from 0 to 1"),
            "learn_above": (0 <= self.learn_above <= 1, "from 0 to 1"),
            "scale_factors": (
                1 <= len(self.scale_factors) <= 32
                and all(0.5 <= t <= 2 for t in self.scale_factors),
                "1 to 32 numbers from 0.5 to 2",
            ),
            "scale_interval": (self.scale_interval >= 1, "at least 1"),
            "aspect_factors": (
                len(self.aspect_factors) >= 1 and all(0.5 <= a <= 2 for a in self.aspect_factors),
                "numbers from 0.5 to 2",
            ),
            "halve_above": (self.halve_above > 0, "greater than 0"),
        }
        for field in fields(self):
            valid, range_ = allowed.get(field.name, (True, ""))
            value = getattr(self, field.name)
            finite = not isinstance(value, float) or math.isfinite(value)
            if not (valid and finite):
                raise TrackingError(f"{field.name} = {value} is not allowed: give {range_}.")

    @property
    def pool(self) -> tuple[tuple[float, float], ...]:
        """Factors of height and width that are tried, in the order of equation (14)."""
        return tuple(
            (factor * math.sqrt(aspect), factor / math.sqrt(aspect))
            for aspect in self.aspect_factors
            for factor in self.scale_factors
        )
