"""What of a batch is done already, and why the rest is not."""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from situp_annotate.batch.journal import Event
from situp_annotate.errors import SitupError
from situp_annotate.outcomes import VideoReport, entry_sha256
from situp_annotate.pipeline import versions
from situp_annotate.recipe import Recipe
from situp_annotate.results import SUMMARY_FILE
from situp_annotate.types import VideoJob
from situp_annotate.video import list_images

__all__ = ["Stamp", "complete_report", "plan_batch", "stamp_of"]

Stamp = list[int]
"""Size in bytes and time stamp in nanoseconds of a video: while both stay, so does its content."""

_TOUCHED = "the video's file was touched: its content has to be compared"


def stamp_of(path: Path) -> Stamp | None:
    """The stamp of a video file or a folder of pictures; None if it cannot be read."""
    try:
        files = list_images(path) if path.is_dir() else [path]
        stats = [file.stat() for file in files]
    except (OSError, SitupError, ValueError):
        return None
    return [
        sum(each.st_size for each in stats),
        max((each.st_mtime_ns for each in stats), default=0),
    ]


def _read_summary(folder: Path) -> dict[str, Any] | None:
    try:
        summary = json.loads((folder / SUMMARY_FILE).read_bytes())
    except (OSError, ValueError):
        return None
    return summary if isinstance(summary, dict) else None


def _changed_settings(before: Any, now: Mapping[str, Any]) -> list[str]:  # noqa: ANN401
    """Names of the settings in which two recipes differ."""
    before = before if isinstance(before, dict) else {}
    return [
        f"{section}.{key}"
        for section, values in now.items()
        for key, value in values.items()
        if not isinstance(before.get(section), dict) or before[section].get(key) != value
    ]


def _reason(
    job: VideoJob, folder: Path, summary: Mapping[str, Any], settings: Mapping[str, Any]
) -> str | None:
    """Why what stands in a folder is not what is wanted, the content of the video aside."""
    if summary.get("entry_sha256") != entry_sha256(job):
        return "its boxes in the manifest have changed"
    changed = _changed_settings(summary.get("recipe"), settings)
    if changed:
        more = f" and {len(changed) - 1} more settings" if len(changed) > 1 else ""
        return f"the recipe has changed: {changed[0]}{more}"
    makers = summary.get("versions")
    made_by = makers.get("situp-annotate") if isinstance(makers, dict) else None
    if made_by != versions()["situp-annotate"]:
        return f"it was made by version {made_by}"
    outputs = summary.get("outputs")
    present = {entry.name for entry in os.scandir(folder)}
    missing = [name for name in outputs if name not in present] if isinstance(outputs, list) else []
    if not isinstance(outputs, list) or missing:
        return f"{', '.join(missing) or SUMMARY_FILE} is missing"
    return None


def _find_reason(
    job: VideoJob, output: Path, settings: Mapping[str, Any], last: Event | None
) -> str | None:
    if last is not None and last["event"] == "failed":
        return f"it failed ({last.get('kind')})"
    folder = output / job.id
    summary = _read_summary(folder)
    if summary is None:
        return "it is not done yet" if not folder.exists() else f"{SUMMARY_FILE} is missing"
    reason = _reason(job, folder, summary, settings)
    if reason is not None:
        return reason
    stamp = stamp_of(job.path)
    if stamp is None:
        return "the video cannot be read"
    return None if last is not None and last.get("stamp") == stamp else _TOUCHED


def plan_batch(
    jobs: Sequence[VideoJob],
    output: Path,
    recipe: Recipe,
    last: Mapping[str, Event],
    *,
    fresh: bool = False,
) -> list[str | None]:
    """Why each video of a batch has to be worked on; None for those that are up to date.

    Parameters
    ----------
    jobs, output, recipe
        As of `annotate_batch`.
    last : mapping of str to Event
        How videos ended when they were last worked on, by their ids.
    fresh : bool
        Whether all are to be done anew.

    Notes
    -----
    The videos themselves are not read: as long as size and time stamp are what they were, the
    content is taken to be. Otherwise whoever works on a video finds out.
    """
    if fresh:
        return ["all are to be done anew"] * len(jobs)
    settings = recipe.as_dict()
    return [_find_reason(job, output, settings, last.get(job.id)) for job in jobs]


def complete_report(job: VideoJob, output: Path, recipe: Recipe) -> VideoReport | None:
    """The report of a video if its outputs are there and are what is wanted.

    Whether they were made from the video as it is now, its hash in the report tells.

    Parameters
    ----------
    job, output, recipe
        As of `annotate_video`.
    """
    folder = output / job.id
    summary = _read_summary(folder)
    if summary is None or _reason(job, folder, summary, recipe.as_dict()) is not None:
        return None
    try:
        return VideoReport.from_dict(summary)
    except ValueError:
        return None
