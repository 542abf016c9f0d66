"""Rows of MOTChallenge: one a box, no header, frames counted from 1, sorted by frame, then id.

A result has the columns ``frame,id,bb_left,bb_top,bb_width,bb_height,conf,x,y,z``, the unused world
coordinates x, y, z being −1. Ground truth has nine: ``conf`` is a flag, 0 for boxes to ignore, and
``class,visibility`` follow. Corners are 0-based as CVAT and TrackEval take them, unless
``pixel_origin=1``.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from types import TracebackType
from typing import Self

from situp_annotate.errors import BoxError, SitupError
from situp_annotate.formats.sinks import close_file
from situp_annotate.formats.zipped import read_text
from situp_annotate.types import BoundingBox, Frame, State, TrackPoint

__all__ = [
    "LARGEST",
    "NO_TRACK",
    "MotRow",
    "MotSink",
    "parse_mot",
    "read_mot",
    "result_row",
    "truth_row",
]

NO_TRACK = -1
"""Id of boxes that belong to no track: those of a detector."""

_COLUMNS = 7
"""As many as are needed; TrackEval and its like ignore what follows."""

_TRUTH_COLUMNS = 9

LARGEST = 2**31 - 1
"""Of frames, ids and classes."""


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
    class_number : int or None
        Of ground truth only.
    visibility : float or None
        Share of the object that is in view; of ground truth only.
    """

    frame: int
    track_id: int
    box: BoundingBox
    confidence: float
    class_number: int | None = None
    visibility: float | None = None


def _decimal(number: float) -> str:
    """Write with three decimals at most: ``12``, ``12.5``, never ``-0``."""
    text = f"{number:.3f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _first_columns(frame: int, point: TrackPoint, pixel_origin: int) -> str:
    box = point.box
    numbers = (
        box.x + pixel_origin,
        box.y + pixel_origin,
        # A box never shrinks to nothing in writing: readers refuse those.
        max(box.width, 0.001),
        max(box.height, 0.001),
    )
    return f"{frame + 1},{point.track_id},{','.join(_decimal(number) for number in numbers)}"


def result_row(frame: int, point: TrackPoint, *, pixel_origin: int = 0) -> str:
    """Write a row of ten columns, with the line's end; the frame counts from 0."""
    first = _first_columns(frame, point, pixel_origin)
    return f"{first},{_decimal(point.confidence)},-1,-1,-1\n"


def truth_row(frame: int, point: TrackPoint, class_number: int) -> str:
    """Write a row of nine columns, with the line's end; the frame counts from 0.

    What is not seen has visibility 0: CVAT takes anything more for visible.
    """
    visibility = int(point.state is State.VISIBLE)
    return f"{_first_columns(frame, point, 0)},1,{class_number},{visibility}\n"


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
            if point.state in self._states:
                self._file.write(result_row(frame.index, point, pixel_origin=self._origin))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        close_file(self._file, exc_type)


def _whole(cell: str, name: str, least: int) -> int:
    number = float(cell)
    if not (number.is_integer() and least <= number <= LARGEST):
        raise ValueError(f"{name} {cell.strip()}")
    return int(number)


def _finite(cell: str, name: str) -> float:
    number = float(cell)
    if not isfinite(number):
        raise ValueError(f"{name} {cell.strip()}")
    return number


def _parse(line: str, pixel_origin: int) -> MotRow:
    cells = line.split(",")
    if len(cells) < _COLUMNS:
        raise ValueError(f"{len(cells)} columns")
    frame, track_id = _whole(cells[0], "frame", 1), _whole(cells[1], "id", NO_TRACK)
    x, y, width, height = (float(cell) for cell in cells[2:6])
    row = MotRow(
        frame - 1,
        track_id,
        BoundingBox(x - pixel_origin, y - pixel_origin, width, height),
        _finite(cells[6], "confidence"),
    )
    if len(cells) != _TRUTH_COLUMNS:
        return row
    return replace(
        row,
        class_number=_whole(cells[7], "class", -LARGEST),
        visibility=_finite(cells[8], "visibility"),
    )


def parse_mot(text: str, place: str, *, pixel_origin: int = 0) -> list[MotRow]:
    """Read rows in the order of the text.

    Parameters
    ----------
    text : str
        Rows of seven columns or more; what follows ``conf`` is ignored but in rows of nine.
    place : str
        Of the text, such as its file, for messages.
    pixel_origin : int
        Coordinate of the picture's top-left corner in the text: 0 or 1.

    Raises
    ------
    SitupError
        If a line is no such row, or a track's second in its frame; names place, line and what is
        wrong.
    """
    rows, seen = [], set()
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip():
            continue
        try:
            row = _parse(line, pixel_origin)
        except (ValueError, BoxError) as error:
            raise SitupError(
                f"{place}: line {number}: {line[:80]!r} is not a row of MOT ({str(error)[:120]}); "
                "give frame from 1, id, left, top, width, height, confidence."
            ) from error
        key = (row.frame, row.track_id)
        if key in seen:
            raise SitupError(
                f"{place}: line {number}: track {row.track_id} has a row in frame {row.frame + 1} "
                f"already; give one box a track and frame."
            )
        if row.track_id != NO_TRACK:
            seen.add(key)
        rows.append(row)
    return rows


def read_mot(path: Path, *, pixel_origin: int = 0) -> list[MotRow]:
    """Read the rows of a file, as :func:`parse_mot` does.

    Raises
    ------
    SitupError
        If the file cannot be read, too.
    """
    return parse_mot(read_text(path), str(path), pixel_origin=pixel_origin)
