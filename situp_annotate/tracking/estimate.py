"""What a tracker says of a picture."""

from dataclasses import dataclass

from situp_annotate.types import BoundingBox

__all__ = ["Estimate"]


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
