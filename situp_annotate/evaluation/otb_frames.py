"""Which frames of OTB's sequences count: the traps of the data set, in one place.

* Numbers of a line are separated by commas, tabs or blanks, mixed even within a file: left to
  :func:`~situp_annotate.formats.otb.read_boxes`.
* Truth may begin at a later picture: David's first row belongs to picture 300, BlurCar1's to 247,
  BlurCar3's to 3, BlurCar4's to 18. Some copies hold the pictures before, others do not, and
  others count anew from 1.
* Board's pictures have five digits (``00001.jpg``): pictures are told apart by number, never by
  the length of their names.
* David, Diving, Football1, Freeman3 and Freeman4 have more pictures than rows of truth; what is
  beyond the truth is not run.
* Tiger1 is run from picture 6, as a hand hides the target before: the first five rows of its truth
  do not count. Some copies have left them out already.
* Jogging, Skating2 and Human4 have numbered truth files, ``groundtruth_rect.1.txt``; Human4 has
  the second only. Targets are called ``Jogging.1``, and so on.
* Boxes may stick out of the picture. One whose x or y is not positive, counted from 1, counts as
  absent in scores; see :mod:`~situp_annotate.evaluation.metrics`.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

__all__ = ["first_picture", "scored_pictures", "scored_rows"]

# Numbers of the first and the last picture that count, by name in lower case.
_EXCERPTS = {
    "blurcar1": (247, 988),
    "blurcar3": (3, 359),
    "blurcar4": (18, 397),
    "david": (300, 770),
    "diving": (1, 215),
    "football1": (1, 74),
    "freeman3": (1, 460),
    "freeman4": (1, 283),
    "tiger1": (6, 354),
}


def first_picture(sequence: str) -> int | None:
    """Number of the picture that a sequence begins with; None for those without traps."""
    excerpt = _EXCERPTS.get(sequence.casefold())
    return excerpt and excerpt[0]


def scored_rows(sequence: str, rows: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Rows of truth, or of a result, that count.

    Parameters
    ----------
    sequence : str
        Name of the sequence, without the number of a target.
    rows : ndarray
        (n, 4), either from the first picture of all on or those that count.
    """
    excerpt = _EXCERPTS.get(sequence.casefold())
    if excerpt is not None and len(rows) == excerpt[1]:
        return rows[excerpt[0] - 1 :]
    return rows


def scored_pictures(sequence: str, paths: Sequence[Path], count: int) -> list[int]:
    """Places of the pictures that belong to the rows of truth.

    Parameters
    ----------
    sequence : str
        Name of the sequence.
    paths : sequence of Path
        All pictures, in order.
    count : int
        Rows of truth that count.

    Returns
    -------
    list of int
        Indices into `paths`, as many as `count`, or fewer where pictures are missing.
    """
    excerpt = _EXCERPTS.get(sequence.casefold())
    if excerpt is not None and len(paths) != count:
        first, last = excerpt
        inside = [i for i, path in enumerate(paths) if first <= _number(path) <= last]
        if len(inside) == count:
            return inside
    return list(range(min(count, len(paths))))


def _number(picture: Path) -> int:
    return int(picture.stem) if picture.stem.isdecimal() else 0
