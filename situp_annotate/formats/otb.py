"""Ground truth in OTB's layout: ``groundtruth_rect*.txt`` in the folder that has ``img/``.

A line a frame from the first on: x, y, width, height, separated by commas, tabs or blanks (OTB
mixes them), with pixels counted from 1. Where the object is absent, numbers are NaN or sizes not
positive. Of several targets, each has a file with its number: ``groundtruth_rect.1.txt``.
"""

import math
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from situp_annotate.errors import BoxError, SitupError
from situp_annotate.formats.class_labels import checked_label
from situp_annotate.formats.seeds import ImportHints, Seeds
from situp_annotate.formats.zipped import read_text
from situp_annotate.types import BoundingBox, Keyframe, Track

__all__ = ["TRUTH", "read_boxes", "read_otb", "recognizes_otb"]

TRUTH = "groundtruth_rect"
"""How the names of files with ground truth begin."""

_NUMBERED = re.compile(re.escape(TRUTH) + r"\.([1-9]\d{0,8})")


def _numbers(line: str) -> list[float]:
    """Four numbers, of which none is infinite.

    Raises
    ------
    ValueError
        If the line is something else.
    """
    numbers = [float(word) for word in re.split(r"\s*,\s*|\s+", line.strip())]
    if len(numbers) != 4 or np.isinf(numbers).any():
        raise ValueError
    return numbers


def read_boxes(path: Path) -> npt.NDArray[np.float64]:
    """Read boxes, one a line, separated by commas, tabs or blanks.

    Returns
    -------
    ndarray
        (n, 4), as the file counts.

    Raises
    ------
    SitupError
        If the file cannot be read, or a line has not four numbers.
    """
    rows = []
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        if not line.strip():
            continue
        try:
            rows.append(_numbers(line))
        except ValueError as error:
            raise SitupError(
                f"{path}: line {number}: {line[:80]!r} is not a box; give four numbers: x, y, "
                f"width, height."
            ) from error
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def recognizes_otb(path: Path, head: bytes) -> bool:
    """Whether a file is called as OTB calls it, or begins with a line of four numbers."""
    if path.name.startswith(TRUTH):
        return True
    line = next(iter(head.decode("utf-8-sig", "replace").strip().splitlines()), "")
    try:
        _numbers(line)
    except ValueError:
        return False
    return True


def _box(numbers: list[float], origin: int, place: str) -> BoundingBox | None:
    x, y, width, height = numbers
    if not (math.isfinite(x) and math.isfinite(y) and width > 0 and height > 0):
        return None
    try:
        return BoundingBox(x - origin, y - origin, width, height)
    except BoxError as error:
        raise SitupError(f"{place}: {error}") from error


def _keyframes(path: Path, origin: int) -> Iterator[Keyframe]:
    was_there = False
    for frame, numbers in enumerate(read_boxes(path).tolist()):
        box = _box(numbers, origin, f"{path}: box {frame + 1}")
        if box or was_there:
            yield Keyframe(frame, box)
        was_there = box is not None


def _targets(path: Path) -> dict[int, Path]:
    """The file of each target of a sequence, by number."""
    if not _NUMBERED.fullmatch(path.stem):
        return {1: path}
    others = (file for file in path.parent.glob(f"{TRUTH}.*") if file.suffix == path.suffix)
    files = [path, *others]
    return {int(found[1]): file for file in files if (found := _NUMBERED.fullmatch(file.stem))}


def _track(path: Path, number: int, label: str, origin: int) -> Track:
    keyframes = tuple(_keyframes(path, origin))
    if not keyframes:
        raise SitupError(f"{path}: there is no box in this file; give x, y, width, height a line.")
    return Track(number, checked_label(label, str(path)), keyframes)


def read_otb(path: Path, hints: ImportHints) -> list[Seeds]:
    """Read the boxes of one sequence.

    Parameters
    ----------
    path : Path
        A file with a line for each frame. For one that is numbered, all numbered ones beside it
        are read.
    hints : ImportHints
        ``label`` of the targets; ``pixel_origin`` (1).

    Returns
    -------
    list of Seeds
        One, named after the folder of a file that is called as OTB calls it, else after the file.
        A track, whose id is the number of its file or 1, has a keyframe for each line with a box,
        and where the object leaves.

    Raises
    ------
    SitupError
        If a file cannot be read, a line has not four numbers, or there is no box.
    """
    origin = 1 if hints.pixel_origin is None else hints.pixel_origin
    tracks = [
        _track(file, number, hints.label, origin) for number, file in sorted(_targets(path).items())
    ]
    name = path.absolute().parent.name if path.name.startswith(TRUTH) else path.stem
    return [Seeds(name, tuple(tracks))]
