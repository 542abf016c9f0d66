"""What all exports have in common: which labels, and how exact."""

from dataclasses import dataclass

from situp_annotate.errors import RecipeError
from situp_annotate.types import State

__all__ = ["ExportOptions"]


@dataclass(frozen=True, slots=True)
class ExportOptions:
    """How labels are exported.

    Attributes
    ----------
    iou : float
        In (0, 1]: where keyframes are thinned, what every interpolated box overlaps the label
        in its place by, at least, as intersection over union.
    states : tuple of State
        Labels in other states are left out.
    images : bool
        Whether a training set gets its pictures, too.

    Raises
    ------
    RecipeError
        If ``iou`` is out of its range.
    """

    iou: float = 0.9
    states: tuple[State, ...] = (State.VISIBLE, State.OCCLUDED)
    images: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.iou <= 1:
            raise RecipeError(f"iou = {self.iou} is not allowed: give more than 0, and 1 at most.")
