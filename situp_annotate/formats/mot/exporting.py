"""Export to MOTChallenge: results, ground truth, and the archive that CVAT imports.

The class of a box is the number of the line that has its label in ``labels.txt``, beside
``gt.txt``, as CVAT and datumaro read it. In one export, a label has the same number everywhere.
"""

import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.labelled import LabelledVideo
from situp_annotate.formats.mot.rows import result_row, truth_row

__all__ = ["write_cvat_mot", "write_mot", "write_mot_truth"]

_BEGINNING_OF_TIME = (1980, 1, 1, 0, 0, 0)
"""Of zip archives; so that the same labels give the same bytes whenever they are written."""


def write_mot(videos: Iterable[LabelledVideo], folder: Path, options: ExportOptions) -> None:
    """Write ``<id>.txt`` for each video: a result as TrackEval scores it."""
    for video in videos:
        with (folder / f"{video.id}.txt").open("w", encoding="utf-8", newline="\n") as file:
            for frame, _, point in video.in_states(options.states):
                file.write(result_row(frame, point))


def _count_labels(numbers: dict[str, int], video: LabelledVideo) -> None:
    """Number the labels that are new, from where it stands on."""
    for track in video.tracks:
        numbers.setdefault(track.track.label, len(numbers) + 1)


def _truth(video: LabelledVideo, numbers: Mapping[str, int], options: ExportOptions) -> str:
    return "".join(
        truth_row(frame, point, numbers[track.track.label])
        for frame, track, point in video.in_states(options.states)
    )


def _labels(numbers: Mapping[str, int]) -> str:
    # A label is a line, whatever blanks are in it.
    return "".join(" ".join(label.split()) + "\n" for label in numbers)


def _sequence_info(video: LabelledVideo) -> str:
    """Write ``seqinfo.ini``: these seven keys and whole numbers, or datumaro refuses it."""
    info = video.info
    return (
        f"[Sequence]\nname={video.id}\nimDir=img1\nframeRate={max(round(info.frame_rate), 1)}\n"
        f"seqLength={video.frame_count}\nimWidth={info.width}\nimHeight={info.height}\n"
        f"imExt=.jpg\n"
    )


def write_mot_truth(videos: Iterable[LabelledVideo], folder: Path, options: ExportOptions) -> None:
    """Write ``<id>/gt/gt.txt``, ``gt/labels.txt`` and ``seqinfo.ini`` for each video."""
    numbers: dict[str, int] = {}
    for video in videos:
        _count_labels(numbers, video)
        sequence = folder / video.id
        (sequence / "gt").mkdir(parents=True)
        texts = {
            "gt/gt.txt": _truth(video, numbers, options),
            "gt/labels.txt": _labels(numbers),
            "seqinfo.ini": _sequence_info(video),
        }
        for name, text in texts.items():
            (sequence / name).write_text(text, encoding="utf-8", newline="\n")


def write_cvat_mot(videos: Iterable[LabelledVideo], folder: Path, options: ExportOptions) -> None:
    """Write ``<id>.zip`` for each video: an archive that CVAT imports as "MOT 1.1"."""
    numbers: dict[str, int] = {}
    for video in videos:
        _count_labels(numbers, video)
        # No seqinfo.ini: CVAT knows the video, and is strict about it.
        texts = {"gt/gt.txt": _truth(video, numbers, options), "gt/labels.txt": _labels(numbers)}
        with zipfile.ZipFile(folder / f"{video.id}.zip", "w") as archive:
            for name, text in texts.items():
                member = zipfile.ZipInfo(name, _BEGINNING_OF_TIME)
                archive.writestr(member, text, compress_type=zipfile.ZIP_DEFLATED)
