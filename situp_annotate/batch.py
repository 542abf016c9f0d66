"""Annotate many videos: one worker process each; one video's failure never costs another."""

import json
import os
import time
import traceback
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, Literal

import cv2

from situp_annotate.compiling import compile_kernels
from situp_annotate.errors import EXIT_FAILED, EXIT_OK, OutputError, SitupError, WorkerError
from situp_annotate.executors import ProcessExecutor, SerialExecutor, result_of
from situp_annotate.formats.staging import discard_staging, write_whole
from situp_annotate.outcomes import VideoFailure, VideoReport
from situp_annotate.overview import overview_html
from situp_annotate.pipeline import annotate_video, versions
from situp_annotate.progress import BatchProgress, FrameCounters
from situp_annotate.recipe import Recipe
from situp_annotate.results import BATCH_FILE, REPORT_FILE
from situp_annotate.types import VideoJob

__all__ = ["BatchReport", "Outcome", "annotate_batch", "core_count"]

_POLL_S = 0.2

Outcome = VideoReport | VideoFailure


@dataclass(frozen=True, slots=True)
class BatchReport:
    """What became of a batch: the content of ``batch.json``.

    Attributes
    ----------
    outcomes : tuple of VideoReport or VideoFailure
        In the order of the jobs; of an interrupted batch only the videos that were done.
    started_at : str
        ISO 8601, UTC.
    elapsed_s : float
        Wall time of the batch.
    workers : int
        Processes at a time; 0 for the serial executor.
    recipe : Recipe
        The settings of all videos.
    interrupted : bool
        Whether it was stopped before its end.
    """

    outcomes: tuple[Outcome, ...]
    started_at: str
    elapsed_s: float
    workers: int
    recipe: Recipe
    interrupted: bool = False

    @property
    def failures(self) -> tuple[VideoFailure, ...]:
        """The videos that failed."""
        return tuple(outcome for outcome in self.outcomes if isinstance(outcome, VideoFailure))

    @property
    def exit_code(self) -> int:
        """0 when all went well, 1 when a video failed."""
        return EXIT_FAILED if self.failures else EXIT_OK

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON data."""
        return {
            "version": 1,
            "interrupted": self.interrupted,
            "succeeded": len(self.outcomes) - len(self.failures),
            "failed": len(self.failures),
            "started_at": self.started_at,
            "elapsed_s": round(self.elapsed_s, 3),
            "workers": self.workers,
            "videos": [outcome.as_dict() for outcome in self.outcomes],
            "recipe": self.recipe.as_dict(),
            "versions": versions(),
        }


@dataclass(frozen=True, slots=True)
class _Options:
    """How :func:`annotate_video` is to be called for every job."""

    threads: int
    overwrite: bool
    cache: bool


_counters = FrameCounters(0)


def _start(counters: FrameCounters) -> None:
    """First call in a worker: one thread for OpenCV, since processes share the cores."""
    global _counters
    _counters = counters
    cv2.setNumThreads(1)
    compile_kernels()


def _annotate(
    index: int, job: VideoJob, output: Path, recipe: Recipe, options: _Options
) -> Outcome:
    """Do one job; whatever goes wrong becomes a plain value that can cross processes."""
    try:
        return annotate_video(
            job,
            output,
            recipe,
            threads=options.threads,
            overwrite=options.overwrite,
            cache=options.cache,
            on_progress=partial(_counters.report, index),
        )
    except SitupError as error:
        return VideoFailure.of(job, error)
    except Exception as error:  # noqa: BLE001 - one video's failure must not cost another
        where = traceback.extract_tb(error.__traceback__)[-1]
        message = (
            f"An internal error, please report it: {type(error).__name__}: {error} "
            f"({Path(where.filename).name}:{where.lineno})."
        )
        return VideoFailure(job.id, str(job.path), "internal", message)


class _Batch:
    """One batch in progress."""

    def __init__(
        self,
        jobs: Sequence[VideoJob],
        output: Path,
        counters: FrameCounters,
        on_progress: Callable[[BatchProgress], None] | None,
    ) -> None:
        self._jobs = jobs
        self._output = output
        self._counters = counters
        self._on_progress = on_progress
        self._outcomes: list[Outcome | None] = [None] * len(jobs)

    @property
    def outcomes(self) -> tuple[Outcome, ...]:
        return tuple(outcome for outcome in self._outcomes if outcome is not None)

    def run(self, executor: Executor, recipe: Recipe, options: _Options) -> None:
        indices: dict[Future[Outcome], int] = {}
        for index, job in enumerate(self._jobs):
            future = executor.submit(_annotate, index, job, self._output, recipe, options)
            indices[future] = index
            if future.done():
                self._collect([(indices.pop(future), future)])
        while indices:
            done, _ = wait(indices, timeout=_POLL_S, return_when=FIRST_COMPLETED)
            self._collect((indices.pop(future), future) for future in done)

    def _collect(self, finished: Iterable[tuple[int, Future[Outcome]]]) -> None:
        for index, future in finished:
            job = self._jobs[index]
            try:
                outcome = result_of(future)
            except WorkerError as error:
                discard_staging(self._output / job.id)
                outcome = VideoFailure.of(job, error)
            self._outcomes[index] = outcome
        if self._on_progress is not None:
            through = [outcome is not None for outcome in self._outcomes]
            self._on_progress(self._counters.progress(through))

    def discard_unfinished(self) -> None:
        for job, outcome in zip(self._jobs, self._outcomes, strict=True):
            if outcome is None:
                discard_staging(self._output / job.id)


def core_count() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _check_output(output: Path, jobs: Sequence[VideoJob], *, overwrite: bool) -> None:
    """Find out what stands in the way before any work is done."""
    if output.exists() and not output.is_dir():
        raise OutputError(f"{output}: the output must be a folder, but a file is there.")
    if overwrite:
        return
    names = (BATCH_FILE, REPORT_FILE, *(job.id for job in jobs))
    present = [name for name in names if (output / name).exists()]
    if present:
        more = f" and {len(present) - 1} more" if len(present) > 1 else ""
        raise OutputError(
            f"{output}: {present[0]}{more} is already there; replace with --overwrite, or choose "
            f"another output folder."
        )


def annotate_batch(
    jobs: Sequence[VideoJob],
    output: str | Path,
    recipe: Recipe | None = None,
    *,
    workers: int | None = None,
    executor: Literal["process", "serial"] = "process",
    overwrite: bool = False,
    cache: bool = True,
    on_progress: Callable[[BatchProgress], None] | None = None,
) -> BatchReport:
    """Annotate videos, each in a process of its own; write ``batch.json`` beside their folders.

    Parameters
    ----------
    jobs : sequence of VideoJob
        ``load_manifest(path).jobs``; ids unique.
    output : str or Path
        Gets a folder for each video; made when missing.
    recipe : Recipe, optional
        Defaults to the paper's tracker and all outputs.
    workers : int, optional
        Processes at a time; as many as cores by default. Cores that are left over follow the
        tracks of a video side by side. Results do not depend on it.
    executor : str
        ``"process"``, or ``"serial"`` to run everything in this process, one by one.
    overwrite : bool
        Replace outputs that are already there.
    cache : bool
        Whether to keep what the tracker says in ``output / ".cache"``, and to use what an earlier
        run has kept there. Results do not depend on it.
    on_progress : callable, optional
        Called a few times a second with a :class:`BatchProgress`.

    Returns
    -------
    BatchReport
        A failed video is an outcome in it, not an exception.

    Raises
    ------
    OutputError
        If outputs are already there and ``overwrite`` is false, or nothing can be written.
    KeyboardInterrupt
        After the workers are stopped and ``batch.json`` tells which videos are complete.

    Notes
    -----
    As everywhere with processes that are spawned, a script that calls this needs the usual
    ``if __name__ == "__main__":``.
    """
    output, recipe = Path(output), recipe or Recipe()
    _check_output(output, jobs, overwrite=overwrite)
    started_at, started = datetime.now(UTC), time.perf_counter()
    counters = FrameCounters(len(jobs))
    batch = _Batch(jobs, output, counters, on_progress)
    processes = 0 if executor == "serial" else min(workers or core_count(), max(len(jobs), 1))
    threads = max(1, core_count() // max(1, processes))

    interrupted = True
    runner = _make_executor(processes, counters)
    try:
        batch.run(runner, recipe, _Options(threads, overwrite, cache))
        interrupted = False
    finally:
        # When all is done this only spares the wait for idle processes.
        runner.shutdown(cancel_futures=True)
        batch.discard_unfinished()
        report = BatchReport(
            batch.outcomes,
            started_at.isoformat(timespec="seconds"),
            time.perf_counter() - started,
            processes,
            recipe,
            interrupted,
        )
        _write_report(report, output)
    return report


def _write_report(report: BatchReport, output: Path) -> None:
    """Write what became of the batch, for machines and for people."""
    text = json.dumps(report.as_dict(), indent=2, ensure_ascii=False)
    write_whole(output / BATCH_FILE, text + "\n")
    if report.recipe.outputs.report:
        page = overview_html(report.outcomes, interrupted=report.interrupted)
        write_whole(output / REPORT_FILE, page)
    else:
        (output / REPORT_FILE).unlink(missing_ok=True)  # of the run that is replaced


def _make_executor(processes: int, counters: FrameCounters) -> Executor:
    if processes == 0:
        _start(counters)
        return SerialExecutor()
    return ProcessExecutor(processes, _start, (counters,))
