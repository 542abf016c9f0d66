"""What a CVAT for video (or for images) XML holds, and what CVAT would drop of it."""

from collections.abc import Iterator
from pathlib import Path
from typing import IO

from situp_annotate.inspection.cvat_survey import CvatSurvey, read_cvat
from situp_annotate.inspection.report import FileReport, Grade, Remark, count, problem_report
from situp_annotate.inspection.rows import Fault

__all__ = ["inspect_cvat"]


def inspect_cvat(path: Path, file: IO[bytes]) -> FileReport | None:
    """Look at an XML file; None when it is well-formed, but not from CVAT.

    Parameters
    ----------
    path : Path
        What the report calls it.
    file : binary file
        Read from where it stands to its end, in pieces; entities and whatever lies elsewhere are
        refused.
    """
    survey = CvatSurvey()
    fault = read_cvat(file, survey)
    if survey.root != "annotations":
        return None if fault is None else _broken(path, survey, fault)
    if fault is not None:
        return _broken(path, survey, fault)
    kind = "CVAT for images" if survey.images and not survey.tracks else "CVAT for video"
    version = survey.texts.get("version", "of unknown version")
    title = (
        f"{kind} {version}, {count(survey.tracks, 'track')}, {count(survey.boxes, 'box', 'boxes')}"
    )
    return FileReport(path, "cvat", title, tuple(_facts(survey)), tuple(_remarks(survey)))


def _broken(path: Path, survey: CvatSurvey, fault: str) -> FileReport:
    name = "CVAT XML" if survey.root == "annotations" else "XML"
    message = f"The file breaks off or is damaged: {fault}. Export it anew."
    return problem_report(path, "cvat", f"{name}, not readable", message)


def _facts(survey: CvatSurvey) -> Iterator[tuple[str, str]]:
    texts = survey.texts
    if "original_size" in texts or "width" in texts:
        yield "picture", f"{texts.get('width', '?')} × {texts.get('height', '?')}"
    if "size" in texts:
        yield "task", f"{texts['size'][:20]} frames, mode {texts.get('mode', 'not given')[:20]}"
    if "source" in texts:
        yield "video", texts["source"][:200]
    labels = [f"{name or 'none'}: {n}" for name, n in survey.used_labels.most_common(20)]
    yield "labels", ", ".join(labels) or ", ".join(survey.labels[:20]) or "none"
    if survey.tracks:
        yield "tracks", str(survey.tracks)
        yield (
            "boxes",
            (
                f"{survey.boxes}, of which {survey.keyframes} are keyframes; {survey.outside} say "
                "that the object is outside"
            ),
        )
        yield "frames", f"up to {survey.last_frame} (counted from 0)"
    if survey.images:
        yield "images", f"{survey.images}, with {count(survey.image_boxes, 'box', 'boxes')}"


def _remarks(survey: CvatSurvey) -> Iterator[Remark]:
    if survey.images and not survey.tracks:
        yield Remark(
            Grade.PROBLEM,
            "images",
            "This is CVAT for images: boxes of single pictures, which nothing joins to tracks. "
            "Export the task again as “CVAT for video 1.1”.",
        )
        return
    if survey.tracks == 0:
        yield Remark(
            Grade.WARNING, "empty", "There is no track in it: the task has no annotations yet."
        )
    yield from _dropped(survey)
    yield from survey.tally.remarks(_FAULTS)
    yield from _task_remarks(survey)


def _dropped(survey: CvatSurvey) -> Iterator[Remark]:
    others = survey.boxes - survey.keyframes - survey.tally.number("not_a_box")
    if others:
        yield Remark(
            Grade.NOTE,
            "not_keyframes",
            f"{count(others, 'box', 'boxes')} of {survey.boxes} are not keyframes: CVAT drops "
            "them when it imports the file and puts boxes on straight lines between keyframes in "
            "their place. An import here uses keyframes only, too. As CVAT wrote the file nothing "
            "is lost by that; boxes that another tool has put there are.",
        )
    if survey.others:
        named = ", ".join(f"{count(n, name)}" for name, n in survey.others.most_common())
        yield Remark(
            Grade.WARNING,
            "shapes",
            f"There are shapes that are no boxes ({named}); they are passed over.",
        )


def _task_remarks(survey: CvatSurvey) -> Iterator[Remark]:
    unknown = [name for name in survey.used_labels if name not in survey.labels]
    if survey.labels and unknown:
        yield Remark(
            Grade.WARNING,
            "labels",
            f"Labels of tracks that the task does not define: {', '.join(unknown[:10])[:200]}. "
            "CVAT refuses the file until the task has them.",
        )
    size = survey.texts.get("size", "")
    if size.isdecimal() and len(size) < 10 and survey.last_frame >= int(size):
        yield Remark(
            Grade.WARNING,
            "past_the_end",
            f"Boxes go up to frame {survey.last_frame}, but the task has {int(size)} frames, 0 to "
            f"{int(size) - 1}. Is it of another video, or of a task that takes every n-th frame?",
        )


_FAULTS = (
    Fault(
        Grade.PROBLEM,
        "not_a_box",
        "box",
        "No frame, or no four numbers for the corners",
        "Such a box cannot be read; export the file anew.",
    ),
    Fault(
        Grade.PROBLEM,
        "double",
        "box",
        "A second box of a track in the same frame",
        "It is not clear which one is meant. Keep one.",
    ),
    Fault(
        Grade.WARNING,
        "double_end",
        "box",
        "outside=1 after outside=1",
        "The object cannot leave twice; CVAT imports that and fails when it exports later on. Keep "
        "the first one.",
    ),
    Fault(
        Grade.WARNING,
        "lost_switch",
        "box",
        "Goes out or comes back in a box that is not a keyframe",
        "CVAT drops that box, so that the object stays out, or in, for longer. Make it a keyframe.",
    ),
    Fault(
        Grade.WARNING,
        "no_keyframe",
        "track",
        "No keyframe at all",
        "CVAT drops these tracks as a whole. Make a box of each a keyframe.",
    ),
    Fault(
        Grade.WARNING,
        "empty_box",
        "box",
        "No width or no height",
        "There is nothing to track in it. Draw it anew.",
    ),
    Fault(
        Grade.NOTE,
        "unsorted",
        "box",
        "A box before the one above it",
        "Readers that go through in order of the file may stumble.",
    ),
)
