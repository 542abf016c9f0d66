"""Boxes of other trackers: a file a target, as OTB's trackers leave them.

A folder holds ``NAME.txt`` or ``NAME_TRACKER.txt`` (x, y, width, height a line, counted from 1),
or ``.mat`` of the same names, see :mod:`~situp_annotate.evaluation.mat_results`. Capital letters
do not matter, and ``Jogging.1``, ``Jogging-1`` and ``Jogging_1`` are one name. Instead of a
folder, the beginning of the names of files beside each truth can be given: with ``boxes``, those
of ``Jogging.1`` are ``Jogging/boxes.1.txt``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from situp_annotate.errors import SitupError
from situp_annotate.evaluation.benchmark import Target, comparable_name
from situp_annotate.evaluation.mat_results import read_mat_boxes
from situp_annotate.evaluation.otb_frames import first_picture, scored_rows
from situp_annotate.formats.otb import read_boxes

__all__ = ["ForeignResults", "read_results"]

_SUFFIXES = (".txt", ".mat")


@dataclass(frozen=True, slots=True)
class ForeignResults:
    """Boxes of one tracker.

    Attributes
    ----------
    name : str
        The tracker's.
    place : str
        Where they come from, as it was given.
    boxes : dict of str to ndarray
        By target: (n, 4), counted from 1, a row for each row of truth.
    """

    name: str
    place: str
    boxes: dict[str, npt.NDArray[np.float64]]


def read_results(name: str, place: str, targets: Sequence[Target]) -> ForeignResults:
    """Read the boxes of the targets that there are boxes of.

    Parameters
    ----------
    name : str
        What to call the tracker.
    place : str
        Folder, or beginning of the names of files in the sequences' folders.
    targets : sequence of Target
        Whose boxes to read.

    Raises
    ------
    SitupError
        If there are none, a file cannot be read, two files are of one target, or one has fewer
        boxes than there are rows of truth.
    """
    folder = Path(place)
    paths = _in_folder(folder, targets) if folder.is_dir() else _beside_truth(place, targets)
    if not paths:
        raise SitupError(
            f"{place}: no boxes of {targets[0].name} or any other target; give a folder with "
            f"NAME.txt or NAME.mat, or the name of files beside each truth."
        )
    present = [target for target in targets if target.name in paths]
    boxes = {target.name: _read(paths[target.name], target) for target in present}
    return ForeignResults(name, place, boxes)


def _beside_truth(stem: str, targets: Sequence[Target]) -> dict[str, Path]:
    if not stem or Path(stem).name != stem:
        return {}
    found = {}
    for target in targets:
        if target.folder is not None:
            number = target.name.removeprefix(target.sequence)
            path = target.folder / f"{stem}{number}.txt"
            if path.exists():
                found[target.name] = path
    return found


def _in_folder(folder: Path, targets: Sequence[Target]) -> dict[str, Path]:
    files = sorted(path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES)
    names = {path: comparable_name(path.stem) for path in files}
    sequences = [target.sequence for target in targets]
    found = {}
    for target in targets:
        wanted = [target.name]
        if sequences.count(target.sequence) == 1:
            wanted.append(target.sequence)  # as Human4, of which only the second target counts
        path = _file_of([comparable_name(each) for each in wanted], names)
        if path is not None:
            found[target.name] = path
    return found


def _file_of(wanted: Sequence[str], names: dict[Path, str]) -> Path | None:
    """The file of the first name that fits: whole, else with something after it."""
    for name in wanted:
        whole = [path for path, each in names.items() if each == name]
        longer = [path for path, each in names.items() if each.startswith(f"{name}_")]
        fitting = whole or longer
        if len(fitting) > 1:
            raise SitupError(
                f"{fitting[0]}: {fitting[1].name} beside it is of the same target; keep one of "
                f"them in the folder."
            )
        if fitting:
            return fitting[0]
    return None


def _read(path: Path, target: Target) -> npt.NDArray[np.float64]:
    if path.suffix.lower() == ".mat":
        boxes, start = read_mat_boxes(path)
        counted = first_picture(target.sequence)
        if start is not None and counted is not None and start < counted:
            boxes = boxes[counted - start :]
    else:
        boxes = scored_rows(target.sequence, read_boxes(path))
    if len(boxes) < len(target.truth):
        raise SitupError(
            f"{path}: {len(boxes)} boxes, but the truth of {target.name} has {len(target.truth)}; "
            f"give a box for each frame, NaN where there is none."
        )
    return boxes
