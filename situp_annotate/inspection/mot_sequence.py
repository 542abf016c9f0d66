"""What stands around MOT's rows: ``seqinfo.ini``, ``labels.txt``, the archive CVAT wants."""

import configparser
import zipfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from situp_annotate.formats.zipped import Member, open_readable
from situp_annotate.inspection.mot import mot_facts, mot_remarks
from situp_annotate.inspection.mot_survey import MotSurvey, survey_mot
from situp_annotate.inspection.report import FileReport, Grade, Remark, count
from situp_annotate.inspection.rows import read_lines

__all__ = ["GT_MEMBER", "inspect_mot_folder", "inspect_mot_zip", "inspect_seqinfo"]

GT_MEMBER = "gt/gt.txt"
_KEYS = ("name", "imDir", "frameRate", "seqLength", "imWidth", "imHeight", "imExt")
_WHOLE_KEYS = frozenset({"frameRate", "seqLength", "imWidth", "imHeight"})
_MOT_CLASSES = 13
_MAX_TEXT = 2**20


def _read_seqinfo(text: str) -> dict[str, str]:
    """Return the keys of the section Sequence, in lower case.

    Raises
    ------
    ValueError
        If it is no such file; says why.
    """
    parser = configparser.ConfigParser(interpolation=None)
    try:
        parser.read_string(text.lstrip("\ufeff"))
    except configparser.Error as error:
        raise ValueError(" ".join(str(error).split())) from error
    if not parser.has_section("Sequence"):
        raise ValueError("it has no section [Sequence]")
    return dict(parser["Sequence"])


def _seqinfo_remarks(text: str, survey: MotSurvey | None) -> Iterator[Remark]:
    try:
        values = _read_seqinfo(text)
    except ValueError as error:
        yield Remark(
            Grade.PROBLEM, "seqinfo", f"seqinfo.ini cannot be read: {error}. CVAT refuses it."
        )
        return
    missing = [key for key in _KEYS if key.lower() not in values]
    if missing:
        yield Remark(
            Grade.PROBLEM,
            "seqinfo_keys",
            f"seqinfo.ini lacks {', '.join(missing)}; CVAT wants all of {', '.join(_KEYS)}, and "
            "refuses the archive. Add them, or leave seqinfo.ini out: CVAT does not need it.",
        )
    for key in _KEYS:
        value = values.get(key.lower(), "0")
        if key in _WHOLE_KEYS and not value.strip().isdecimal():
            yield Remark(
                Grade.PROBLEM,
                "seqinfo_whole",
                f"seqinfo.ini says {key}={value[:40]}; CVAT wants a whole number and refuses the "
                "archive. Round it, or leave seqinfo.ini out.",
            )
    length = values.get("seqlength", "").strip()
    last = max(survey.frames) if survey is not None and survey.frames else 0
    if length.isdecimal() and len(length) < 10 and last > int(length):
        yield Remark(
            Grade.PROBLEM,
            "seq_length",
            f"Rows go up to frame {last}, but seqinfo.ini says seqLength={int(length)}; TrackEval "
            "refuses that. One of them is wrong, or they belong to different videos.",
        )


def _text_on_disk(path: Path) -> str:
    with path.open("rb") as file:
        return file.read(_MAX_TEXT).decode("utf-8", "replace")


def inspect_seqinfo(path: Path) -> FileReport:
    """Look at a ``seqinfo.ini`` that stands alone."""
    text = _text_on_disk(path)
    try:
        facts = tuple(_read_seqinfo(text).items())[:20]
    except ValueError:
        facts = ()
    remarks = tuple(_seqinfo_remarks(text, None))
    return FileReport(path, "seqinfo", "seqinfo.ini of a MOT sequence", facts, remarks)


def _label_remarks(labels: list[str] | None, survey: MotSurvey) -> Iterator[Remark]:
    highest = max(survey.classes, default=0)
    if labels is None:
        if highest > _MOT_CLASSES:
            yield Remark(
                Grade.PROBLEM,
                "labels_missing",
                f"There is no labels.txt, and class {highest} is none of MOT's own 1 to "
                f"{_MOT_CLASSES}. Put gt/labels.txt beside gt.txt, a label a line.",
            )
        return
    if highest > len(labels):
        yield Remark(
            Grade.PROBLEM,
            "labels_short",
            f"labels.txt has {count(len(labels), 'line')}, but there are rows of class {highest}: "
            "class 1 is its first line. Add the missing labels.",
        )
    double = sorted(label for label, number in Counter(labels).items() if number > 1)
    if double:
        yield Remark(
            Grade.WARNING,
            "labels_double",
            f"labels.txt has {', '.join(double[:5])[:200]} more than once; CVAT mixes them up.",
        )


def _gt_remarks(survey: MotSurvey) -> Iterator[Remark]:
    if survey.rows and survey.variant != "gt":
        yield Remark(
            Grade.WARNING,
            "not_gt",
            "The rows are not those of ground truth: CVAT takes column 7 for “not ignored” and "
            "column 8 for the class, and expects 9 columns. Write frame, id, left, top, width, "
            "height, 1, class, visibility.",
        )


def inspect_mot_zip(path: Path, archive: zipfile.ZipFile, gt: str) -> FileReport:
    """Look at an archive in CVAT's layout MOT 1.1.

    Parameters
    ----------
    gt : str
        The member that ends in ``gt/gt.txt``.
    """
    prefix = gt.removesuffix(GT_MEMBER)
    names = set(archive.namelist())
    with open_readable(Member(archive, path, gt)) as member:
        survey = survey_mot(read_lines(member))
    labels = None
    if f"{prefix}gt/labels.txt" in names:
        text = _member_text(Member(archive, path, f"{prefix}gt/labels.txt"))
        labels = [line.strip() for line in text.splitlines() if line.strip()]
    remarks = [*mot_remarks(survey), *_gt_remarks(survey), *_label_remarks(labels, survey)]
    if f"{prefix}seqinfo.ini" in names:
        text = _member_text(Member(archive, path, f"{prefix}seqinfo.ini"))
        remarks += _seqinfo_remarks(text, survey)
    if prefix:
        remarks.append(
            Remark(
                Grade.WARNING,
                "prefix",
                f"gt/gt.txt lies in the folder {prefix[:100]} of the archive, not at its top, "
                "where CVAT's own exports have it. Pack the content of the folder.",
            )
        )
    facts = (
        *mot_facts(survey),
        ("labels.txt", "none" if labels is None else ", ".join(labels[:20])[:300]),
        ("seqinfo.ini", "yes" if f"{prefix}seqinfo.ini" in names else "none"),
        ("pictures", str(sum(name.startswith(f"{prefix}img1/") for name in names))),
    )
    title = f"MOT 1.1 archive for CVAT, {count(survey.rows, 'row')}"
    return FileReport(path, "mot_zip", title, facts, tuple(remarks))


def _member_text(member: Member) -> str:
    with open_readable(member) as file:
        return file.read(_MAX_TEXT).decode("utf-8", "replace")


def inspect_mot_folder(folder: Path) -> FileReport:
    """Look at a folder with a sequence of MOTChallenge: ``gt`` or ``det``, and what is around."""
    source = next(
        place for place in (folder / "gt/gt.txt", folder / "det/det.txt") if place.is_file()
    )
    with source.open("rb") as file:
        survey = survey_mot(read_lines(file))
    remarks = list(mot_remarks(survey))
    seqinfo = folder / "seqinfo.ini"
    if seqinfo.is_file():
        remarks += _seqinfo_remarks(_text_on_disk(seqinfo), survey)
    facts = (
        ("rows from", source.relative_to(folder).as_posix()),
        *mot_facts(survey),
        ("seqinfo.ini", "yes" if seqinfo.is_file() else "none"),
    )
    title = f"MOT sequence, {count(survey.rows, 'row')}"
    return FileReport(folder, "mot_sequence", title, facts, tuple(remarks))
