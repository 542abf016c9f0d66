"""Annotate one video: decode, propagate, write. What a worker process does."""

import json
import logging
import platform
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path

import cv2

from situp_annotate.cache import CACHE_FOLDER, VideoCache
from situp_annotate.formats.staging import staged_folder
from situp_annotate.outcomes import CacheUse, VideoReport, entry_sha256
from situp_annotate.outputs import OUTPUTS
from situp_annotate.propagation import Labels, Survey, propagate
from situp_annotate.recipe import Recipe
from situp_annotate.results import SUMMARY_FILE
from situp_annotate.stages import (
    FrameProgress,
    OnProgress,
    Stopwatch,
    TimedFootage,
    frames_to_walk,
)
from situp_annotate.tracking import SitupTracker
from situp_annotate.types import VideoJob
from situp_annotate.video import ForwardWalk, VideoFootage, fingerprint
from situp_annotate.writing import write_labels

__all__ = ["annotate_video", "versions"]

_BYTES_PER_MB = 2**20

_log = logging.getLogger(__name__)

_version = cache(version)  # which reads and parses a file


def versions() -> dict[str, str]:
    """Versions of the tool, of Python and of the libraries that shape the results."""
    packages = ("situp-annotate", "numpy", "scipy", "numba", "av", "mcap")
    return {
        "python": platform.python_version(),
        "opencv": cv2.__version__,  # its package may have any of four names
        **{name: _version(name) for name in packages},
    }


def _propagate(
    job: VideoJob,
    recipe: Recipe,
    cache: VideoCache,
    watch: Stopwatch,
    progress: FrameProgress,
    threads: int,
) -> tuple[Labels, ForwardWalk]:
    """Make the labels; say what there is to know of the video besides its pictures."""
    options, incomplete = recipe.propagation, recipe.decoding.incomplete
    walk, survey = cache.load_walk(job.path, incomplete) or (None, None)
    budget_bytes = options.memory_mb * _BYTES_PER_MB
    with watch.stage("open"):
        footage = VideoFootage(
            job.path,
            incomplete=incomplete,
            limits=recipe.limits,
            budget_bytes=budget_bytes,
            threads=threads,
            walk=walk,
        )

    def expect(count: int, *, surveyed: bool) -> None:
        left = frames_to_walk(job.tracks, options, count, cache.passes, surveyed=surveyed)
        progress.expect(left + (count if recipe.outputs.show_pictures else 0))

    def on_survey(found: Survey) -> None:
        if survey is None:
            cache.save_walk(footage.walk, found)
        expect(found.frame_count, surveyed=True)

    with footage:
        promised = footage.info.frame_count_from_header
        if promised is not None:
            expect(promised, surveyed=walk is not None)
        labels = propagate(
            TimedFootage(footage, watch),
            job.tracks,
            options,
            tracker=partial(SitupTracker, recipe.tracker),
            threads=threads,
            cache=cache.passes,
            survey=survey,
            on_frame=progress.step,
            on_survey=on_survey,
        )
        return labels, footage.walk


def annotate_video(
    job: VideoJob,
    output: str | Path,
    recipe: Recipe | None = None,
    *,
    threads: int = 1,
    overwrite: bool = False,
    cache: bool = True,
    on_progress: OnProgress | None = None,
) -> VideoReport:
    """Propagate the labels of one video and write its outputs to ``output / job.id``.

    Parameters
    ----------
    job : VideoJob
        The video and what a person drew in it.
    output : str or Path
        Folder that gets a folder for the video; made when missing.
    recipe : Recipe, optional
        Defaults to the paper's tracker and all outputs.
    threads : int
        Tracks to follow at a time; with more than one, decoding and encoding overlap with the
        rest, too. Results do not depend on it.
    overwrite : bool
        Replace outputs that are already there.
    cache : bool
        Whether to keep what the tracker says in ``output / ".cache" / job.id``, and to use what
        an earlier run has kept there. Results do not depend on it.
    on_progress : callable, optional
        Called after each frame that is walked through with how many were, and how many will be,
        forward, backward and in writing; None as long as nobody knows.

    Returns
    -------
    VideoReport
        What is written to ``summary.json``, and how long it took.

    Raises
    ------
    VideoError
        If the video cannot be annotated; nothing of it is left in ``output`` then, except that
        the cache may hold what was tracked before the failure.
    OutputError
        If the outputs are already there, or cannot be written.
    """
    recipe, output = recipe or Recipe(), Path(output)
    watch, progress = Stopwatch(), FrameProgress(on_progress)
    replaceable = OUTPUTS if overwrite else None
    with staged_folder(output / job.id, replaceable=replaceable) as folder:
        with watch.stage("hash"):
            sha256 = fingerprint(job.path)
        place = output / CACHE_FOLDER / job.id if cache else None
        kept = VideoCache(place, sha256, recipe.tracker, versions())
        labels, walk = _propagate(job, recipe, kept, watch, progress, threads)
        written = write_labels(
            folder,
            job,
            recipe,
            labels,
            walk,
            sha256=sha256,
            watch=watch,
            progress=progress,
            threads=threads,
        )
        report = VideoReport(
            id=job.id,
            video=walk.info,
            sha256=sha256,
            entry_sha256=entry_sha256(job),
            frames=labels.frame_count,
            tracks=written.tracks,
            skipped=labels.skipped,
            findings=walk.findings,
            outputs=written.outputs,
            cache=CacheUse(len(kept.passes.used), kept.passes.reused),
            seconds=watch.finish(),
        )
        details = {"recipe": recipe.as_dict(), "versions": versions()}
        summary_json = json.dumps({**report.as_dict(), **details}, indent=2, ensure_ascii=False)
        path = folder / SUMMARY_FILE
        path.write_text(summary_json + "\n", encoding="utf-8", newline="\n")
        kept.drop_unused()  # a run that is killed after this has left nothing behind
    progress.finish()
    _log_report(report, recipe)
    return report


def _log_report(report: VideoReport, recipe: Recipe) -> None:
    """Tell what was done, a line each thing."""
    video = report.video
    _log.info(
        "%s: %s: %d × %d, %s, %d frames at %.6g frames a second, decoded by %s",
        *(report.id, video.path, video.width, video.height, video.codec, report.frames),
        *(float(video.frame_rate), video.decoder),
    )
    for finding in report.findings:
        _log.warning("%s: %s", report.id, finding.message)
    for skip in report.skipped:
        _log.warning("%s: %s", report.id, skip.reason)
    _log.info(
        "%s: %d tracks by recipe %s, %d of %d passes from the cache",
        *(report.id, len(report.tracks), recipe.sha256[:12]),
        *(report.cache.reused, report.cache.passes),
    )
    stages = sorted(report.seconds.items(), key=lambda item: -item[1])
    _log.info(
        "%s: wrote %s (seconds: %s)",
        *(report.id, ", ".join(report.outputs)),
        ", ".join(f"{stage} {seconds:.2f}" for stage, seconds in stages),
    )
