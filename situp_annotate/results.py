"""Read back what a run has written, for whatever is made of it later."""

import json
import re
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from situp_annotate.errors import ManifestError, SitupError
from situp_annotate.formats.labelled import LabelledTrack, LabelledVideo
from situp_annotate.formats.labels_csv import read_labels_csv
from situp_annotate.formats.manifest import load_manifest
from situp_annotate.formats.manifest.ids import is_safe_id
from situp_annotate.types import VideoInfo, VideoJob

__all__ = [
    "BATCH_FILE",
    "LABELS_FILE",
    "LOG_FOLDER",
    "MANIFEST_FILE",
    "REPORT_FILE",
    "SUMMARY_FILE",
    "failed_ids",
    "labelled_video",
    "read_job",
    "read_run",
    "read_video",
    "run_folders",
]

BATCH_FILE = "batch.json"
"""In the output folder: what became of each video."""

LABELS_FILE = "labels.csv"
"""In the folder of a video: its labels."""

LOG_FOLDER = "logs"
"""In the output folder: what happened to each video, a file each."""

MANIFEST_FILE = "manifest.json"
"""In the folder of a video: the manifest of this video alone, as the run was given it."""

REPORT_FILE = "report.html"
"""In the output folder: the review report of the batch; in the folder of a video: its page."""

SUMMARY_FILE = "summary.json"
"""In the folder of a video: what was done with it."""


def labelled_video(folder: Path, job: VideoJob, info: VideoInfo, frame_count: int) -> LabelledVideo:
    """Put the labels in a video's folder together with what else is known of the video.

    Raises
    ------
    SitupError
        If ``labels.csv`` is not there, not a run's, or of a longer video.
    """
    path = folder / LABELS_FILE
    table = read_labels_csv(path)
    last = max(table.times_ns, default=-1)
    if last >= frame_count:
        raise SitupError(
            f"{path}: frame {last} has labels, but the video has {frame_count} frames; annotate "
            "the video again."
        )
    tracks = sorted(job.tracks, key=lambda track: track.id)
    return LabelledVideo(
        id=job.id,
        info=info,
        frame_count=frame_count,
        times_ns=table.times_ns,
        tracks=tuple(LabelledTrack(track, table.points.get(track.id, {})) for track in tracks),
    )


def _read_json(path: Path, *, otherwise: str) -> Any:  # noqa: ANN401
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SitupError(
            f"{path}: cannot be read ({error.strerror or error}); {otherwise}."
        ) from error
    except (ValueError, RecursionError) as error:
        raise SitupError(f"{path}: this is not valid JSON ({error}); {otherwise}.") from error


def read_job(folder: Path) -> VideoJob:
    """Read what a run was given for one video.

    Parameters
    ----------
    folder : Path
        The video's folder in the output folder of the run.

    Raises
    ------
    SitupError
        If its manifest is missing, or not a run's, or of another video.
    """
    path = folder / MANIFEST_FILE
    try:
        job = load_manifest(path, allow_outside=True).jobs[0]
    except ManifestError as error:
        raise SitupError(f"{error} Annotate the video again.") from error
    if job.id != folder.name:
        raise SitupError(
            f"{path}: this is of the video {job.id!r}, not {folder.name!r}; annotate the video "
            "again."
        )
    return job


def _rate(text: str) -> Fraction:
    # Fraction takes "1e999999999" as well, and never comes to an end of it.
    if not re.fullmatch(r"\d{1,30}(/0*[1-9]\d{,29})?", text, re.ASCII):
        raise ValueError(f"{text!r} is no rate")
    return Fraction(text)


def _info(video: dict[str, Any], path: Path) -> VideoInfo:
    rates = {name: _rate(video[name]) for name in ("frame_rate", "pixel_aspect_ratio")}
    info = TypeAdapter(VideoInfo).validate_python({**video, **rates, "path": path})
    if not (0 < info.width < 2**31 and 0 < info.height < 2**31 and info.frame_rate > 0):
        raise ValueError("no size of a video")
    return info


def _frame_count(summary: dict[str, Any]) -> int:
    frames = summary["frames"]
    if type(frames) is not int or not 0 <= frames < 2**31:
        raise ValueError("no number of frames")
    return frames


def read_video(folder: Path) -> LabelledVideo:
    """Read the labels of one video that a run has annotated.

    Parameters
    ----------
    folder : Path
        The video's folder in the output folder of the run.

    Raises
    ------
    SitupError
        If a file is missing or not a run's.
    """
    path = folder / SUMMARY_FILE
    summary = _read_json(path, otherwise="annotate the video first")
    job = read_job(folder)
    try:
        info, frame_count = _info(summary["video"], job.path), _frame_count(summary)
    except (KeyError, TypeError, ValueError) as error:
        raise SitupError(
            f"{path}: this is not what `situp-annotate run` writes; annotate the video again."
        ) from error
    return labelled_video(folder, job, info, frame_count)


def _ids(output: Path, status: str) -> list[str]:
    """Ids of the videos of a run that ended so, in the order of its manifest."""
    path = output / BATCH_FILE
    hint = "give the output folder of `situp-annotate run`"
    batch = _read_json(path, otherwise=hint)
    try:
        ids = [video["id"] for video in batch["videos"] if video["status"] == status]
        are_folders = all(map(is_safe_id, ids)) and len({*ids}) == len(ids)
    except (KeyError, TypeError, AttributeError):
        ids, are_folders = [], False
    if not are_folders:
        raise SitupError(f"{path}: this is not what a run writes; {hint}.")
    return ids


def run_folders(output: Path) -> tuple[Path, ...]:
    """Folders of the videos that a run has annotated, in the order of its manifest.

    Parameters
    ----------
    output : Path
        The output folder of the run.

    Raises
    ------
    SitupError
        If it is no run's output folder.
    """
    return tuple(output / video_id for video_id in _ids(output, "ok"))


def failed_ids(output: Path) -> tuple[str, ...]:
    """Ids of the videos that a run could not annotate; as `run_folders`."""
    return tuple(_ids(output, "failed"))


def read_run(output: Path) -> Iterator[LabelledVideo]:
    """Read the labels of every video that a run has annotated, one after the other.

    Parameters
    ----------
    output : Path
        The output folder of the run.

    Raises
    ------
    SitupError
        As `run_folders` and `read_video` do.
    """
    return map(read_video, run_folders(output))
