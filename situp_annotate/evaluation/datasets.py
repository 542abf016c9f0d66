"""Sequences in OTB layout: a folder with ``img/`` and ``groundtruth_rect*.txt``."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from situp_annotate.errors import SitupError
from situp_annotate.formats.otb import TRUTH, read_boxes
from situp_annotate.types import BoundingBox

__all__ = ["OtbSequence", "OtbTarget", "find_sequences"]


@dataclass(frozen=True, slots=True)
class OtbTarget:
    """One annotated object of a sequence.

    Attributes
    ----------
    name : str
        The sequence's name, with ``.1``, ``.2`` … when it has several targets.
    truth : ndarray
        (n, 4): x, y, width, height, counted from 1 as OTB does; NaN where the object is absent.
    """

    name: str
    truth: npt.NDArray[np.float64]

    @property
    def first_box(self) -> BoundingBox:
        """The box of the first frame, counted from 0."""
        x, y, width, height = (float(number) for number in self.truth[0])
        return BoundingBox(x - 1, y - 1, width, height)


@dataclass(frozen=True, slots=True)
class OtbSequence:
    """A sequence and its targets, in the order of their numbers."""

    name: str
    folder: Path
    targets: tuple[OtbTarget, ...]


def _sequence(folder: Path) -> OtbSequence:
    targets = tuple(
        OtbTarget(folder.name + path.stem.removeprefix(TRUTH), read_boxes(path))
        for path in sorted(folder.glob(f"{TRUTH}*.txt"))
    )
    return OtbSequence(folder.name, folder, targets)


def find_sequences(folder: Path) -> list[OtbSequence]:
    """Sequences below a folder, sorted by name; folders without ground truth are passed over.

    Raises
    ------
    SitupError
        If there is no sequence, or a ground truth cannot be read.
    """
    folders = sorted(path for path in folder.iterdir() if any(path.glob(f"{TRUTH}*.txt")))
    if not folders:
        raise SitupError(f"{folder}: no sequence here; one is a folder with img/ and {TRUTH}.txt.")
    return [_sequence(path) for path in folders]
