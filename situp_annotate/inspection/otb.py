"""What a text file with a box a line (OTB) or a polygon a line (VOT) is."""

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from situp_annotate.inspection.report import FileReport, Grade, Remark, count
from situp_annotate.inspection.rows import Fault, Tally
from situp_annotate.video.image_folder import list_images

__all__ = ["inspect_otb"]

_BOX, _POLYGON = 4, 8


@dataclass(slots=True)
class _Survey:
    rows: int = 0
    boxes: int = 0
    separators: set[str] = field(default_factory=set)
    tally: Tally = field(default_factory=Tally)

    def add(self, number: int, line: str, columns: int) -> None:
        self.rows += 1
        place = f"line {number}"
        cells = re.split(r"[,\s]+", line.strip(", \t\ufeff"), maxsplit=2 * _POLYGON)
        separator = "comma" if "," in line else "tab" if "\t" in line else "space"
        self.separators.add(separator)
        try:
            values = [float(cell) for cell in cells]
        except ValueError:
            self.tally.add("not_a_number", f"{place}, {line[:60]!r}")
            return
        if len(values) != columns:
            self.tally.add("columns", f"{place}, {len(values)} numbers")
        elif not all(map(math.isfinite, values)) or (columns == _BOX and min(values[2:]) <= 0):
            self.tally.add("absent", place)
        else:
            self.boxes += 1


def inspect_otb(path: Path, lines: Iterable[tuple[int, str]], *, columns: int) -> FileReport:
    """Report on a text file with a box (4 numbers) or a polygon (8 numbers) a line."""
    survey = _Survey()
    for number, line in lines:
        survey.add(number, line, columns)
    polygon = columns == _POLYGON
    shape = "polygons, as VOT has them" if polygon else "ground truth in OTB's layout"
    facts = [
        ("frames", f"{survey.rows}, one a line"),
        ("polygons" if polygon else "boxes", str(survey.boxes)),
        ("corners", "counted from 1, as OTB does; importing it as OTB takes 1 off"),
        ("separated by", " and ".join(sorted(survey.separators))),
    ]
    pictures = _pictures_beside(path)
    if pictures:
        facts.append(("pictures", f"{pictures} beside it"))
    remarks = tuple(_remarks(survey, pictures, polygon=polygon))
    return FileReport(path, "otb", f"{shape}, {count(survey.rows, 'line')}", tuple(facts), remarks)


def _pictures_beside(path: Path) -> int:
    try:
        return len(list_images(path.parent))
    except OSError:
        return 0


def _remarks(survey: _Survey, pictures: int, *, polygon: bool) -> Iterator[Remark]:
    yield from survey.tally.remarks(_FAULTS)
    if polygon:
        yield Remark(
            Grade.PROBLEM,
            "polygon",
            "Eight numbers a line are the corners of a polygon. Boxes are needed here: write the "
            "left, top, width and height of the upright rectangle around each.",
        )
        return
    if pictures and pictures != survey.rows:
        yield Remark(
            Grade.WARNING,
            "frame_count",
            f"There are {count(survey.rows, 'line')} for {count(pictures, 'picture')}. Some "
            "sequences are labelled only in a part (David from picture 300 on): line 1 may not be "
            "the first picture. Find out before importing.",
        )


_FAULTS = (
    Fault(Grade.PROBLEM, "not_a_number", "line", "Not a number", "Every line needs numbers only."),
    Fault(
        Grade.PROBLEM,
        "columns",
        "line",
        "Another number of values than in the first line",
        "Every line needs left, top, width and height.",
    ),
    Fault(
        Grade.NOTE,
        "absent",
        "line",
        "No box (NaN, or a size of 0)",
        "The object is out of view there.",
    ),
)
