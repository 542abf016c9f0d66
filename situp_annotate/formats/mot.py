"""MOTChallenge's result format: ``frame,id,bb_left,bb_top,bb_width,bb_height,conf,x,y,z``.

One row a box, no header, frames counted from 1, sorted by frame, then id; the unused world
coordinates x, y, z are −1. Corners are 0-based as CVAT and TrackEval take them, unless
``pixel_origin=1``.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from types import TracebackType
from typing import Self

from situp_annotate.errors import BoxError, SitupError
from situp_annotate.types import BoundingBox, Frame, State, TrackPoint

__all__ = ["MotRow", "MotSink", "read_mot"]

_COLUMNS = 7
"""As many as are needed; TrackEval and its like ignore what follows."""


@dataclass(frozen=True, slots=True)
class MotRow:
    """One row: a box of a track in a frame, counted from 0.

    Attributes
    ----------
    frame : int
        Index of the frame, from 0.
    track_id : int
        The track's id.
    box : BoundingBox
        In pixels, 0-based.
    confidence : float
        As written.
    """

    frame: int
    track_id: int
    box: BoundingBox
    confidence: float


def _decimal(number: float) -> str:
    """Write with three decimals at most: ``12``, ``12.5``, never ``-0``."""
    text = f"{number:.3f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


class MotSink:
    """Writes ``mot.csv``.

    Parameters
    ----------
    path : Path
        File to write.
    pixel_origin : int
        Coordinate of the picture's top-left corner: 0 or 1.
    states : collection of State
        Boxes in other states get no rows.
    """

    def __init__(
        self, path: Path, *, pixel_origin: int = 0, states: Collection[State] = tuple(State)
    ) -> None:
        self._file = path.open("w", encoding="utf-8", newline="\n")
        self._origin = pixel_origin
        self._states = frozenset(states)

    @property
    def wants_pictures(self) -> bool:
        """False: rows are numbers only."""
        return False

    def write(self, frame: Frame, points: Sequence[TrackPoint]) -> None:
        """Add the rows of one frame."""
        for point in points:
            if point.state not in self._states:
                continue
            box = point.box
            numbers = (
                box.x + self._origin,
                box.y + self._origin,
                # A box never shrinks to nothing in writing: readers refuse those.
                max(box.width, 0.001),
                max(box.height, 0.001),
                point.confidence,
            )
            cells = ",".join(_decimal(number) for number in numbers)
            self._file.write(f"{frame.index + 1},{point.track_id},{cells},-1,-1,-1\n")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._file.close()


def _parse(line: str, pixel_origin: int) -> MotRow:
    cells = line.split(",")
    if len(cells) < _COLUMNS:
        raise ValueError(f"{len(cells)} columns")
    frame, track_id = int(cells[0]), int(cells[1])
    if frame < 1:
        raise ValueError(f"frame {frame}")
    x, y, width, height, confidence = (float(cell) for cell in cells[2:_COLUMNS])
    if not isfinite(confidence):
        raise ValueError(f"confidence {confidence}")
    box = BoundingBox(x - pixel_origin, y - pixel_origin, width, height)
    return MotRow(frame - 1, track_id, box, confidence)


def read_mot(path: Path, *, pixel_origin: int = 0) -> list[MotRow]:
    """Read rows in the order of the file.

    Parameters
    ----------
    path : Path
        A file in this format; columns after ``conf`` are ignored.
    pixel_origin : int
        Coordinate of the picture's top-left corner in the file: 0 or 1.

    Raises
    ------
    SitupError
        If the file cannot be read or a line is no such row, or a track's second in its frame;
        names file, line and what is wrong.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise SitupError(f"{path}: cannot be read as a text file: {error}.") from error
    rows, seen = [], set()
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip():
            continue
        try:
            row = _parse(line, pixel_origin)
        except (ValueError, BoxError) as error:
            raise SitupError(
                f"{path}: line {number}: {line!r} is not a row of MOT ({error}); give frame from "
                f"1, id, left, top, width, height, confidence."
            ) from error
        if (row.frame, row.track_id) in seen:
            raise SitupError(
                f"{path}: line {number}: track {row.track_id} has a row in frame {row.frame + 1} "
                f"already; give one box a track and frame."
            )
        seen.add((row.frame, row.track_id))
        rows.append(row)
    return rows
