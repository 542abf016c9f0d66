"""What a text file is, by its first lines."""

import re
from itertools import islice
from pathlib import Path

from situp_annotate.inspection.mot import inspect_mot
from situp_annotate.inspection.mot_sequence import inspect_seqinfo
from situp_annotate.inspection.otb import inspect_otb
from situp_annotate.inspection.progress import OnProgress, reporting
from situp_annotate.inspection.recipes import inspect_toml
from situp_annotate.inspection.report import FileReport, count, problem_report
from situp_annotate.inspection.rows import read_lines

__all__ = ["inspect_text"]

_BOX, _POLYGON, _YOLO, _FEWEST_OF_MOT = 4, 8, 5, 6
_HEADERS = {
    "frame,time_s,track_id,": ("labels_csv", "labels of a run (labels.csv)"),
    "rank,track_id,label,": ("review_csv", "what to review of a run (review.csv)"),
}


def inspect_text(path: Path, *, on_progress: OnProgress | None = None) -> FileReport:
    """Look at a text file that is neither JSON nor XML."""
    with (
        path.open("rb") as file,
        reporting(file.tell, path.stat().st_size, on_progress),
    ):
        first = [line for _, line in islice(read_lines(file), 2)]
        file.seek(0)
        head = first[0].lstrip("\ufeff") if first else ""
        for header, (kind, title) in _HEADERS.items():
            if head.startswith(header):
                rows = sum(1 for _ in read_lines(file)) - 1
                facts = (("rows", str(rows)), ("columns", head[:300]))
                return FileReport(path, kind, f"{title}, {count(rows, 'row')}", facts)
        numbers = [_count_numbers(line) for line in first]
        if numbers and numbers[0] in {_BOX, _POLYGON}:
            return inspect_otb(path, read_lines(file), columns=numbers[0])
        if numbers and max(numbers) >= _FEWEST_OF_MOT:
            return inspect_mot(path, read_lines(file))
    if path.suffix.lower() == ".toml":
        return inspect_toml(path)
    if re.match(r"\[Sequence\]", head, re.IGNORECASE):
        return inspect_seqinfo(path)
    return _unknown(path, head, numbers[0] if numbers else 0)


def _count_numbers(line: str) -> int:
    """How many numbers a line holds; 0 if there is anything else in it."""
    cells = re.split(r"[,;\s]+", line.strip("\ufeff,; \t"))
    try:
        for cell in cells:
            float(cell)
    except ValueError:
        return 0
    return len(cells)


def _unknown(path: Path, head: str, numbers: int) -> FileReport:
    if not head:
        return problem_report(
            path, "unknown", "a text file without text", "There is nothing in it."
        )
    if numbers == _YOLO:
        message = (
            "Five numbers a line look like YOLO's labels of one picture: class, centre and size. "
            "They say neither which frame nor which object; nothing here reads them."
        )
        return problem_report(path, "yolo", "probably YOLO labels", message)
    shown = "".join(char if char.isprintable() else " " for char in head[:80])
    message = (
        f"The text begins “{shown}” and is nothing that is known here. Read are MOT "
        "(frame,id,left,top,width,height,confidence,…), OTB (left,top,width,height), CVAT's XML, "
        "JSON of several tools, and recipes in TOML."
    )
    return problem_report(path, "unknown", "a text file of an unknown kind", message)
