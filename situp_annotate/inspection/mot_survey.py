"""Go through the rows of a MOTChallenge text file, in bounded memory."""

import math
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

from situp_annotate.inspection.rows import Tally

__all__ = ["PEDESTRIAN", "MotSurvey", "survey_mot"]

_COLUMNS = 7
_GT_COLUMNS = 9
_MAX_REMEMBERED = 1_000_000
"""Pairs of frame and id; beyond, doubles are not looked for."""
_MAX_CELLS = 20
_MAX_CLASS = 10_000
_NO_TRACK = -1
PEDESTRIAN = 1


@dataclass(slots=True)
class MotSurvey:
    """Running figures over the rows of a file."""

    rows: int = 0
    columns: Counter[int] = field(default_factory=Counter)
    ids: set[int] = field(default_factory=set)
    frames: set[int] = field(default_factory=set)
    classes: Counter[int] = field(default_factory=Counter)
    tally: Tally = field(default_factory=Tally)
    lowest_conf: float = math.inf
    highest_conf: float = -math.inf
    least_x: float = math.inf
    least_y: float = math.inf
    flags: set[float] = field(default_factory=set)
    ignored: int = 0
    _pairs: set[tuple[int, int]] = field(default_factory=set)
    _last_frame: int = -(2**63)

    @property
    def variant(self) -> str:
        """``"result"``, ``"gt"`` or ``"det"``."""
        if self.ids == {-1}:
            return "det"
        usual = self.columns.most_common(1)[0][0] if self.columns else 0
        return "gt" if usual == _GT_COLUMNS and self.flags <= {0.0, 1.0} else "result"

    def add(self, number: int, line: str) -> None:
        """Take in one line."""
        if number == 1 and line.startswith("\ufeff"):
            self._note("bom", number)
            line = line.lstrip("\ufeff")
        cells = line.split(",", _MAX_CELLS)
        if len(cells) < 2:
            cells = re.split(r"[\s;]+", line, maxsplit=_MAX_CELLS)
            self._note("separator", number)
        values = [_number(cell) for cell in cells]
        if self.rows == 0 and not any(value is not None for value in values[:6]):
            self._note("header", number, repr(line[:60]))
            return
        self.rows += 1
        self.columns[len(cells)] += 1
        numbers = [value for value in values[:_COLUMNS] if value is not None]
        if len(numbers) < min(len(cells), _COLUMNS) or not all(map(math.isfinite, numbers)):
            self._note("not_a_number", number, repr(line[:60]))
        elif len(numbers) < _COLUMNS:
            self._note("columns", number, f"{len(numbers)} columns")
        else:
            self._add_row(number, cells, numbers)
            self._add_extras(values)

    def _note(self, kind: str, number: int, detail: str = "") -> None:
        self.tally.add(kind, f"line {number}, {detail}" if detail else f"line {number}")

    def _add_row(self, number: int, cells: list[str], numbers: list[float]) -> None:
        frame, track_id = round(numbers[0]), round(numbers[1])
        if not (_is_whole(cells[0]) and _is_whole(cells[1])):
            whole = numbers[0].is_integer() and numbers[1].is_integer()
            self._note("float_ids" if whole else "fraction", number, ",".join(cells[:2]))
        if frame < 1:
            self._note("frame_0" if frame == 0 else "negative_frame", number)
        if track_id == 0:
            self._note("id_0", number)
        elif track_id < 0:
            self._note("id_negative" if track_id == _NO_TRACK else "bad_id", number)
        if frame < self._last_frame:
            self._note("unsorted", number)
        self._last_frame = frame
        self._look_for_doubles(number, frame, track_id)
        _, _, x, y, width, height, conf = numbers
        if width <= 0 or height <= 0:
            self._note("empty_box", number)
        self.least_x, self.least_y = min(self.least_x, x), min(self.least_y, y)
        self.lowest_conf = min(self.lowest_conf, conf)
        self.highest_conf = max(self.highest_conf, conf)
        self.ignored += conf == 0

    def _look_for_doubles(self, number: int, frame: int, track_id: int) -> None:
        if len(self._pairs) >= _MAX_REMEMBERED:
            self._note("unchecked", number)
            return
        self.frames.add(frame)
        self.ids.add(track_id)
        if (frame, track_id) in self._pairs and track_id >= 0:
            self._note("double", number)
        self._pairs.add((frame, track_id))

    def _add_extras(self, values: list[float | None]) -> None:
        if len(self.flags) < 3:
            self.flags.add(values[6] or 0.0)
        if len(values) < _GT_COLUMNS - 1 or values[7] is None or not 0 < values[7] < _MAX_CLASS:
            return
        self.classes[round(values[7])] += 1


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None


def _is_whole(cell: str) -> bool:
    return cell.isdecimal() or re.fullmatch(r"\s*[+-]?\d{1,18}\s*", cell, re.ASCII) is not None


def survey_mot(lines: Iterable[tuple[int, str]]) -> MotSurvey:
    """Go through numbered lines."""
    survey = MotSurvey()
    for number, line in lines:
        survey.add(number, line)
    return survey
