"""The numbers of the tracker, each with the paper's symbol and where it comes from."""

import math
from dataclasses import dataclass, fields

from situp_annotate.errors import TrackingError

__all__ = ["TrackerParams"]


@dataclass(frozen=True, slots=True)
class TrackerParams:
    """Settings of :class:`~situp_annotate.tracking.SitupTracker`; the defaults are the paper's.

    Attributes
    ----------
    padding : float
        Search window over target size, each side; §IV-A. At least 1.
    cell_size : int
        Side of a feature cell in pixels of the window; §IV-A. At least 2.
    label_sigma : float
        Width of the regression target y, equation (2), over the square root of the target's
        area. Greater than 0.
    regularization : float
        λ of the ridge regression, equations (2) and (7). Greater than 0.
    learning_rate : float
        θ of the model update, equation (11). In [0, 1]; 0 keeps the first frame's model.
    scale_factors : tuple of float
        The pool S of scales t, in the order in which equal APCEs are preferred; equation (14).
        ``(1.0,)`` turns the search for scale off.
    halve_above : float
        Targets of this size (square root of the area, pixels) or more are tracked in the picture
        of half size; the authors' code. Greater than 0.
    color_table : str or None
        Path of a colour-name table to use in place of the built-in model; see
        :func:`situp_annotate.tracking.color_names.load_table`.

    Raises
    ------
    TrackingError
        If a value is out of its range.
    """

    padding: float = 2.5
    cell_size: int = 4
    label_sigma: float = 0.1
    regularization: float = 3e-4
    learning_rate: float = 0.004
    scale_factors: tuple[float, ...] = (1.0, 0.995, 1.005, 0.985, 0.99, 1.01, 1.015)
    halve_above: float = 100.0
    color_table: str | None = None

    def __post_init__(self) -> None:
        allowed = {
            "padding": (self.padding >= 1, "at least 1"),
            "cell_size": (self.cell_size >= 2, "at least 2"),
            "label_sigma": (self.label_sigma > 0, "greater than 0"),
            "regularization": (self.regularization > 0, "greater than 0"),
            "learning_rate": (0 <= self.learning_rate <= 1, "from 0 to 1"),
            "scale_factors": (
                len(self.scale_factors) > 0 and all(0.5 <= t <= 2 for t in self.scale_factors),
                "one or more numbers from 0.5 to 2",
            ),
            "halve_above": (self.halve_above > 0, "greater than 0"),
        }
        for field in fields(self):
            valid, range_ = allowed.get(field.name, (True, ""))
            value = getattr(self, field.name)
            finite = not isinstance(value, float) or math.isfinite(value)
            if not (valid and finite):
                raise TrackingError(f"{field.name} = {value} is not allowed: give {range_}.")
