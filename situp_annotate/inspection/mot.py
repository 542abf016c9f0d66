"""What a MOTChallenge text file is, and what of it other tools refuse or misread."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from situp_annotate.inspection.mot_survey import PEDESTRIAN, MotSurvey, survey_mot
from situp_annotate.inspection.report import FileReport, Grade, Remark, count
from situp_annotate.inspection.rows import Fault

__all__ = ["inspect_mot", "mot_facts", "mot_remarks"]

_ORIGIN = "the format does not say whether pixels count from 0 (CVAT, TrackEval) or 1"
_TITLES = {"result": "tracking results", "gt": "ground truth", "det": "detections"}


def inspect_mot(path: Path, lines: Iterable[tuple[int, str]]) -> FileReport:
    """Report on a text file with rows of MOTChallenge."""
    survey = survey_mot(lines)
    title = f"MOT {_TITLES[survey.variant]}, {count(survey.rows, 'row')}"
    return FileReport(path, "mot", title, mot_facts(survey), tuple(mot_remarks(survey)))


def mot_facts(survey: MotSurvey) -> tuple[tuple[str, str], ...]:
    """Return what a MOT file holds, in words."""
    if not survey.frames:
        return (("rows", str(survey.rows)),)
    frames = f"{min(survey.frames)} to {max(survey.frames)} (counted from 1)"
    classes = ", ".join(f"{name}: {n}" for name, n in sorted(survey.classes.items())[:13])
    facts = [
        ("rows", f"{survey.rows}, with {_join(sorted(survey.columns))} columns"),
        ("frames", f"{frames}; {len(survey.frames)} of them have rows"),
        ("ids", "none: −1 in every row" if survey.variant == "det" else str(len(survey.ids))),
        ("confidence", f"{survey.lowest_conf:g} to {survey.highest_conf:g}"),
        ("corners", f"from {survey.least_x:g}, {survey.least_y:g} on; {_ORIGIN}"),
    ]
    return (*facts, ("classes", classes)) if classes else tuple(facts)


def _join(numbers: list[int]) -> str:
    shown = ", ".join(map(str, numbers[:5]))
    return shown + (", …" if len(numbers) > 5 else "")


def mot_remarks(survey: MotSurvey) -> Iterator[Remark]:
    """Yield what other tools refuse or misread, and what this one does."""
    yield from survey.tally.remarks(_FAULTS)
    if survey.rows == 0:
        yield Remark(
            Grade.WARNING, "empty", "There is no row in it; TrackEval takes it for no boxes at all."
        )
        return
    if len(survey.columns) > 1:
        yield Remark(
            Grade.WARNING,
            "columns_differ",
            f"Rows have {_join(sorted(survey.columns))} columns; readers that read a table refuse "
            "that. Write the same columns in every row.",
        )
    yield from _variant_remarks(survey)


def _variant_remarks(survey: MotSurvey) -> Iterator[Remark]:
    if survey.variant == "det":
        yield Remark(
            Grade.NOTE,
            "det",
            "Detections, not tracks: every id is −1. Nothing says which boxes are the same object; "
            "an import makes a track of each, TrackEval refuses it as a result.",
        )
        return
    yield from survey.tally.remarks((_NO_TRACK,))
    if survey.variant == "gt":
        yield from _gt_remarks(survey)
    elif any(number != PEDESTRIAN for number in survey.classes):
        yield Remark(
            Grade.WARNING,
            "class",
            "Column 8 holds other numbers than −1 and 1; TrackEval takes it for the class and "
            "refuses what is not 1, pedestrian. Write −1 there in a result.",
        )
    elif survey.highest_conf > 1 or survey.lowest_conf < 0:
        yield Remark(
            Grade.NOTE,
            "confidence",
            f"Confidence goes from {survey.lowest_conf:g} to {survey.highest_conf:g}, so it is no "
            "probability; scores of different files cannot be compared.",
        )


def _gt_remarks(survey: MotSurvey) -> Iterator[Remark]:
    others = sorted(number for number in survey.classes if number != PEDESTRIAN)
    if others:
        yield Remark(
            Grade.WARNING,
            "class",
            f"There are classes other than 1, pedestrian ({_join(others)}); TrackEval scores "
            "pedestrians only and lets all others count for nothing, without a word. CVAT takes "
            "the class for a line of labels.txt, which has to come along.",
        )
    if survey.ignored:
        yield Remark(
            Grade.NOTE,
            "ignored",
            f"{count(survey.ignored, 'row')} say 0 in column 7: not to be considered when scoring.",
        )


_NO_TRACK = Fault(
    Grade.WARNING,
    "id_negative",
    "row",
    "The id −1, which means no track",
    "TrackEval refuses two of them in a frame, CVAT makes single boxes of them.",
)
_FAULTS = (
    Fault(
        Grade.PROBLEM,
        "header",
        "row",
        "A header",
        "MOT files have none: TrackEval and CVAT refuse it. Delete that line (tail -n +2).",
    ),
    Fault(
        Grade.PROBLEM,
        "separator",
        "row",
        "No commas between the numbers",
        "Nothing reads that as MOT; write commas in place of what stands there.",
    ),
    Fault(
        Grade.PROBLEM,
        "bom",
        "row",
        "A byte-order mark at the start",
        "Readers take it for a part of the first number; save the file as UTF-8 without one.",
    ),
    Fault(
        Grade.PROBLEM,
        "not_a_number",
        "row",
        "Not a finite number",
        "No tool reads these rows; write numbers or take them out.",
    ),
    Fault(
        Grade.PROBLEM,
        "columns",
        "row",
        "Too few columns",
        "Frame, id, left, top, width, height and confidence are needed.",
    ),
    Fault(
        Grade.PROBLEM,
        "frame_0",
        "row",
        "Frame 0",
        "MOT counts frames from 1: TrackEval refuses frame 0, and in CVAT every box comes a frame "
        "too early. Add 1 to every frame if the file counts from 0.",
    ),
    Fault(
        Grade.PROBLEM,
        "fraction",
        "row",
        "A frame or an id that is no whole number",
        "There is no such frame or track.",
    ),
    Fault(
        Grade.PROBLEM,
        "bad_id",
        "row",
        "An id below −1",
        "−1 means no track, and tracks count from 1.",
    ),
    Fault(Grade.PROBLEM, "negative_frame", "row", "A frame below 0", "There is no such frame."),
    Fault(
        Grade.PROBLEM,
        "double",
        "row",
        "A second box of the same id in the same frame",
        "TrackEval refuses that, and nobody can tell which one is meant. Keep one.",
    ),
    Fault(
        Grade.PROBLEM,
        "empty_box",
        "row",
        "A width or height of 0 or less",
        "That is no box, and most tools refuse it. Take these rows out.",
    ),
    Fault(
        Grade.WARNING,
        "float_ids",
        "row",
        "A frame or an id with a decimal point",
        "TrackEval reads that, stricter readers such as CVAT's do not. Write whole numbers.",
    ),
    Fault(
        Grade.WARNING,
        "id_0",
        "row",
        "The id 0",
        "CVAT makes single boxes of these instead of a track. Add 1 to every id, as an import "
        "here does.",
    ),
    Fault(
        Grade.NOTE,
        "unsorted",
        "row",
        "A frame before that of the row above",
        "Most tools sort for themselves; those that read along do not.",
    ),
    Fault(
        Grade.NOTE,
        "unchecked",
        "row",
        "Not looked through for doubles, nor counted above",
        "The file is too long to remember all of its rows.",
    ),
)
