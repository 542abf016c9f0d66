"""What a folder is: pictures, a MOT sequence, the output of a run, or just a folder."""

import re
from collections import Counter
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from situp_annotate.errors import VideoError
from situp_annotate.inspection.decoding import error_remark, walk_frames
from situp_annotate.inspection.json_files import batch_facts, batch_remarks, is_batch, read_json
from situp_annotate.inspection.mot_sequence import inspect_mot_folder
from situp_annotate.inspection.progress import OnProgress
from situp_annotate.inspection.report import FileReport, Grade, Remark, count, problem_report
from situp_annotate.video import open_video
from situp_annotate.video.discovery import VIDEO_SUFFIXES
from situp_annotate.video.image_folder import list_images

__all__ = ["inspect_folder"]

_MAX_ENTRIES = 100_000


def inspect_folder(
    folder: Path, *, quick: bool = False, on_progress: OnProgress | None = None
) -> FileReport:
    """Look at a folder, not at those below it."""
    if (folder / "batch.json").is_file():
        return _inspect_run(folder)
    if any((folder / name).is_file() for name in ("gt/gt.txt", "det/det.txt")):
        return inspect_mot_folder(folder)
    images = list_images(folder)
    entries = list(islice(folder.iterdir(), _MAX_ENTRIES))
    videos = [path for path in entries if path.suffix.lower() in VIDEO_SUFFIXES]
    if images and not videos:
        return _inspect_pictures(folder, images, quick=quick, on_progress=on_progress)
    return _inspect_other(folder, entries, videos)


# ---- pictures ------------------------------------------------------------------------------


def _inspect_pictures(
    folder: Path, images: list[Path], *, quick: bool, on_progress: OnProgress | None
) -> FileReport:
    is_otb = images[0].parent != folder
    title = f"{count(len(images), 'picture')}{', in OTB’s layout' if is_otb else ''}"
    try:
        with open_video(folder) as source:
            size = f"{source.info.width} × {source.info.height}"
            decoded = None if quick else walk_frames(source, len(images), on_progress)
    except VideoError as error:
        return FileReport(folder, "images", title, (), (error_remark(folder, error),))
    truth = sorted(path.name for path in folder.glob("groundtruth_rect*.txt"))
    facts = [
        ("pictures", f"{images[0].name} to {images[-1].name}, in natural order"),
        ("size", size),
        ("decoded", "not decoded" if decoded is None else f"{decoded.frames} of {len(images)}"),
    ]
    if truth:
        facts.append(("true boxes", ", ".join(truth[:5])))
    remarks = [*_name_remarks(images)]
    if decoded is not None and decoded.error is not None:
        remarks.append(error_remark(folder, decoded.error))
    return FileReport(folder, "images", title, tuple(facts), tuple(remarks))


def _name_remarks(images: list[Path]) -> Iterator[Remark]:
    if sorted(path.name for path in images) != [path.name for path in images]:
        yield Remark(
            Grade.WARNING,
            "order",
            "Numbers in the names have different lengths: here 2 comes before 10, but a tool that "
            "sorts by letters takes 10 before 2, and labels land on other pictures. Fill the "
            "numbers up with zeros.",
        )
    suffixes = Counter(path.suffix.lower() for path in images)
    if len(suffixes) > 1:
        named = ", ".join(f"{number} {suffix}" for suffix, number in suffixes.most_common())
        yield Remark(
            Grade.WARNING,
            "suffixes",
            f"There are pictures of different kinds ({named}), and all are taken for frames of "
            "one video. Move those away that are not.",
        )
    numbers = [int(found[-1]) for path in images if (found := re.findall(r"\d{1,15}", path.stem))]
    missing = numbers[-1] - numbers[0] + 1 - len(numbers) if numbers else 0
    if len(numbers) == len(images) and len(set(numbers)) == len(numbers) and missing > 0:
        yield Remark(
            Grade.WARNING,
            "numbering",
            f"Numbers from {numbers[0]} to {numbers[-1]} with {missing} left out. Frames are "
            "counted by place, from 0; a tool that takes the number in the name for the frame "
            "disagrees after the first gap.",
        )


# ---- results and the rest ------------------------------------------------------------------


def _inspect_run(folder: Path) -> FileReport:
    fault = "it is not what a run writes"
    try:
        document = read_json(folder / "batch.json")
    except ValueError as error:
        document, fault = None, str(error)
    if not is_batch(document):
        message = f"batch.json says nothing that can be used: {fault}. Run the batch again."
        return problem_report(folder, "run", "output of a run", message, remark_kind="batch")
    remarks = tuple(batch_remarks(document, folder))
    return FileReport(folder, "run", "output of a run", batch_facts(document), remarks)


def _inspect_other(folder: Path, entries: list[Path], videos: list[Path]) -> FileReport:
    if not entries:
        return problem_report(folder, "unknown", "an empty folder", "There is nothing in it.")
    suffixes = Counter(path.suffix.lower() or "no suffix" for path in entries)
    facts = (("entries", ", ".join(f"{n} {name}" for name, n in suffixes.most_common(8))),)
    if (folder / "summary.json").is_file():
        title = "results of one video"
        advice = "Inspect the files in it, or the folder above it for the whole run."
    elif videos:
        title = f"a folder with {count(len(videos), 'video')}"
        advice = f"`situp-annotate init {folder}` makes a manifest; inspect the videos one by one."
    else:
        title = "a folder"
        message = (
            "It holds no pictures, no videos and no results. Name a video, a folder of pictures, "
            "or a file with labels."
        )
        return problem_report(folder, "unknown", title, message, facts)
    return FileReport(folder, "folder", title, facts, (Remark(Grade.NOTE, "folder", advice),))
