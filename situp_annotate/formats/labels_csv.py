"""``labels.csv``: everything that is known of every label, one row a track and frame.

Frames count from 0, boxes are 0-based, ``time_s`` is exact to the nanosecond. The cells of what a
row does not have are empty: the box of an object that is outside, and ``apce``, ``peak`` and
``scale`` of boxes that no tracker found.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from situp_annotate.errors import BoxError, SitupError
from situp_annotate.formats.outside import OUTSIDE, OutsideTracks
from situp_annotate.formats.sinks import close_file
from situp_annotate.types import (
    NS_PER_S,
    BoundingBox,
    Frame,
    Provenance,
    State,
    Track,
    TrackPoint,
)

__all__ = [
    "LABELS_HEADER",
    "LabelsCsvSink",
    "LabelsTable",
    "label_cells",
    "read_labels_csv",
    "time_cell",
]

_BOX = ("x", "y", "width", "height")
_SIGNALS = ("apce", "peak", "scale")
_LEAST_SIZE = 1e-6
"""A box never shrinks to nothing in writing."""

LABELS_HEADER = (
    *("frame", "time_s", "track_id", "label", "state", "provenance"),
    *(*_BOX, "confidence", *_SIGNALS),
)
"""Names of the columns."""


def _number(value: float | None) -> str:
    """Shortest text that is read back as the same number to a millionth."""
    return "" if value is None else f"{value:.6f}".rstrip("0").rstrip(".")


def _exact(value: float) -> str:
    """Shortest text that is read back as the very same number."""
    return repr(int(value) if value.is_integer() else value)


def time_cell(time_ns: int) -> str:
    """A time as seconds with nine decimals, exactly."""
    sign, (whole, rest) = "-" * (time_ns < 0), divmod(abs(time_ns), NS_PER_S)
    return f"{sign}{whole}.{rest:09d}"


def _nanoseconds(seconds: str) -> int:
    whole, _, rest = seconds.partition(".")
    if not (len(rest) <= 9 and f"{rest}0".isdigit()):
        raise ValueError(f"{seconds!r} is no time in seconds")
    magnitude = abs(int(whole)) * NS_PER_S + int(rest.ljust(9, "0"))
    if magnitude >= 2**63:
        raise ValueError(f"{seconds} seconds")
    return -magnitude if whole.startswith("-") else magnitude


def label_cells(point: TrackPoint) -> tuple[str, ...]:
    """The cells of a label from ``state`` on."""
    x, y, width, height = (float(getattr(point.box, name)) for name in _BOX)
    if point.provenance is Provenance.HUMAN:
        box = map(_exact, (x, y, width, height))  # stays as it was drawn, to the digit
    else:
        box = map(_number, (x, y, max(width, _LEAST_SIZE), max(height, _LEAST_SIZE)))
    signals = (_number(getattr(point, name)) for name in _SIGNALS)
    return (point.state, point.provenance, *box, _number(point.confidence), *signals)


class LabelsCsvSink:
    """Writes ``labels.csv``.

    Parameters
    ----------
    path : Path
        File to write.
    tracks : sequence of Track
        Every track whose points may come.
    """

    def __init__(self, path: Path, *, tracks: Sequence[Track]) -> None:
        self._labels = {track.id: track.label for track in tracks}
        self._outside = OutsideTracks(tracks)
        self._file = path.open("w", encoding="utf-8", newline="")
        self._writer = csv.writer(self._file, lineterminator="\n")
        self._writer.writerow(LABELS_HEADER)

    @property
    def wants_pictures(self) -> bool:
        """False: rows are numbers and words only."""
        return False

    def write(self, frame: Frame, points: Sequence[TrackPoint]) -> None:
        """Add the rows of one frame, by track id."""
        start = (frame.index, time_cell(frame.pts_ns))
        rows = {point.track_id: label_cells(point) for point in points}
        for track in self._outside.at(frame, points):
            blank = ("",) * len(_BOX)
            rows[track.id] = (OUTSIDE, Provenance.HUMAN, *blank, "1", *("",) * len(_SIGNALS))
        for track_id in sorted(rows):
            self._writer.writerow((*start, track_id, self._labels[track_id], *rows[track_id]))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        close_file(self._file, exc_type)


@dataclass(frozen=True, slots=True)
class LabelsTable:
    """What ``labels.csv`` holds.

    Attributes
    ----------
    points : dict of int to dict of int to TrackPoint
        The labels that have a box, by track id and frame.
    times_ns : dict of int to int
        Time of each frame that has a label.
    """

    points: dict[int, dict[int, TrackPoint]]
    times_ns: dict[int, int]


def _point(row: dict[str, str]) -> TrackPoint:
    confidence = float(row["confidence"])
    if not 0 <= confidence <= 1:
        raise ValueError(f"confidence {confidence}")
    signals = {name: float(row[name]) if row[name] else None for name in _SIGNALS}
    return TrackPoint(
        int(row["track_id"]),
        BoundingBox(*(float(row[name]) for name in _BOX)),
        confidence,
        State(row["state"]),
        Provenance(row["provenance"]),
        **signals,
    )


def read_labels_csv(path: Path) -> LabelsTable:
    """Read the file back.

    Parameters
    ----------
    path : Path
        A ``labels.csv``.

    Raises
    ------
    SitupError
        If it cannot be read, has other columns, or a row that a run does not write; names the
        file, the line and what is wrong.
    """
    table = LabelsTable({}, {})
    try:
        with path.open(encoding="utf-8", newline="") as file:
            reader = csv.DictReader(file, strict=True)
            if tuple(reader.fieldnames or ()) != LABELS_HEADER:
                raise SitupError(
                    f"{path}: the first line is not the header of a labels.csv; annotate the video "
                    "again."
                )
            for row in reader:
                _read_row(row, table, f"{path}: line {reader.line_num}")
    except OSError as error:
        raise SitupError(f"{path}: cannot be read: {error.strerror or error}.") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise SitupError(f"{path}: this is not a labels.csv ({error}).") from error
    return table


def _add_row(row: dict[str, str], table: LabelsTable) -> None:
    if len(row) != len(LABELS_HEADER) or None in row.values():
        raise ValueError("not as many cells as columns")
    frame = int(row["frame"])
    if not next(reversed(table.times_ns), 0) <= frame < 2**31:
        raise ValueError(f"frame {frame}")
    table.times_ns[frame] = _nanoseconds(row["time_s"])
    if row["state"] == OUTSIDE:
        return
    point = _point(row)
    points = table.points.setdefault(point.track_id, {})
    if frame in points:
        raise ValueError(f"a second label of track {point.track_id} in frame {frame}")
    points[frame] = point


def _read_row(row: dict[str, str], table: LabelsTable, place: str) -> None:
    try:
        _add_row(row, table)
    except (ValueError, BoxError) as error:
        raise SitupError(
            f"{place}: this is not a row that `situp-annotate run` writes ({str(error)[:120]}); "
            "annotate the video again."
        ) from error
