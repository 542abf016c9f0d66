"""What a worker process does: one video."""

import logging
import os
import traceback
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import cv2

from situp_annotate.batch.resuming import Stamp, complete_report, stamp_of
from situp_annotate.compiling import compile_kernels
from situp_annotate.errors import SitupError
from situp_annotate.executors import is_isolated, report_frames
from situp_annotate.formats.disk import writing_to
from situp_annotate.outcomes import VideoFailure, VideoReport
from situp_annotate.pipeline import annotate_video
from situp_annotate.recipe import Recipe
from situp_annotate.types import VideoJob
from situp_annotate.video import fingerprint

__all__ = ["VideoDone", "WorkOptions", "annotate_job"]

_log = logging.getLogger("situp_annotate")


@dataclass(frozen=True, slots=True)
class WorkOptions:
    """How a video is to be worked on.

    Attributes
    ----------
    threads : int
        Tracks to follow at a time.
    cache : bool
        Whether to use and keep what the tracker says.
    fresh : bool
        Whether to do anew what is done already.
    """

    threads: int
    cache: bool
    fresh: bool


@dataclass(frozen=True, slots=True)
class VideoDone:
    """A video whose outputs are complete; all else about it stands in its ``summary.json``.

    Attributes
    ----------
    report : VideoReport
        What was done.
    stamp : Stamp or None
        Of the video, taken before it was read.
    frames_walked : int
        As progress counts them.
    """

    report: VideoReport
    stamp: Stamp | None
    frames_walked: int


def _print_to(log: Path) -> None:
    """Let everything that this process prints go to a file: libraries in C print a lot."""
    descriptor = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
    for each in (1, 2):
        os.dup2(descriptor, each)
    os.close(descriptor)


@contextmanager
def _logged_to(path: Path) -> Iterator[None]:
    alone = is_isolated()
    if alone:
        _print_to(path)
    handler = logging.FileHandler(path, encoding="utf-8", errors="backslashreplace")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    _log.addHandler(handler)
    _log.setLevel(logging.INFO)
    _log.propagate = not alone
    try:
        yield
    finally:
        _log.removeHandler(handler)
        handler.close()


def annotate_job(
    job: VideoJob,
    output: Path,
    recipe: Recipe,
    options: WorkOptions,
    log: Path,
) -> VideoDone | VideoFailure:
    """Do one job, unless it is done; whatever goes wrong becomes a plain value.

    May be called twice for the same video, say since nobody knows how the first call ended.

    Parameters
    ----------
    job, output, recipe
        As of `annotate_video`.
    options : WorkOptions
        How to work on it.
    log : Path
        File that is told every step.
    """
    if is_isolated():
        cv2.setNumThreads(1)
        compile_kernels()
    with ExitStack() as stack:
        try:
            with writing_to(log):
                stack.enter_context(_logged_to(log))
            return _annotate(job, output, recipe, options)
        except SitupError as error:
            _log.error("%s: %s: %s", job.id, error.kind, error)
            return VideoFailure.of(job, error)
        except MemoryError:
            _log.exception("%s: not enough memory", job.id)
            message = (
                f"{job.path}: there was not enough memory for this video; try it with fewer "
                "--workers."
            )
            return VideoFailure(job.id, str(job.path), "memory", message)
        except Exception as error:  # noqa: BLE001 - one video's failure must not cost another
            _log.exception("%s: internal error", job.id)
            where = traceback.extract_tb(error.__traceback__)[-1]
            message = (
                f"An internal error, please report it: {type(error).__name__}: {error} "
                f"({Path(where.filename).name}:{where.lineno})."
            )
            return VideoFailure(job.id, str(job.path), "internal", message)


def _annotate(job: VideoJob, output: Path, recipe: Recipe, options: WorkOptions) -> VideoDone:
    stamp = stamp_of(job.path)
    if not options.fresh and (output / job.id).exists():
        report = complete_report(job, output, recipe)
        if report is not None and report.sha256 == fingerprint(job.path):
            _log.info("%s: its outputs are up to date", job.id)
            return VideoDone(report, stamp, 0)
    walked = 0

    def count(done: int, expected: int | None) -> None:
        nonlocal walked
        walked = done
        report_frames(done, expected)

    report = annotate_video(
        job,
        output,
        recipe,
        threads=options.threads,
        overwrite=True,
        cache=options.cache,
        on_progress=count,
    )
    return VideoDone(report, stamp, walked)
