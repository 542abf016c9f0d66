"""Run a batch from its plan to its report, such that it can go on wherever it was stopped."""

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from situp_annotate.batch.journal import Journal, OnEvent, last_endings
from situp_annotate.batch.report import BatchReport, StoredOutcomes, write_report
from situp_annotate.batch.resuming import plan_batch
from situp_annotate.batch.scheduling import Scheduler
from situp_annotate.batch.sizing import core_count, expected_work, workers_for_memory
from situp_annotate.batch.state import RunState, Shard
from situp_annotate.batch.worker import WorkOptions
from situp_annotate.executors import (
    CallLimits,
    ProcessExecutor,
    SerialExecutor,
    VideoExecutor,
    remove_abandoned_folders,
)
from situp_annotate.formats.disk import writing_to
from situp_annotate.formats.staging import recover_staging
from situp_annotate.progress import BatchProgress
from situp_annotate.recipe import Recipe
from situp_annotate.results import BATCH_FILE, LOG_FOLDER, REPORT_FILE
from situp_annotate.types import VideoJob

__all__ = ["annotate_batch", "planned_batch"]

_WARM = ("situp_annotate.batch.warm",)
_YOUNG_S = 10.0
"""Age of a process beyond which a fresh one costs next to nothing against what it has done."""
_MENTION_S = 1.0


def _make_executor(
    executor: Literal["process", "serial"] | VideoExecutor, workers: int, limits: CallLimits
) -> VideoExecutor:
    if isinstance(executor, VideoExecutor):
        return executor
    if executor == "serial":
        return SerialExecutor()
    return ProcessExecutor(workers, limits, _WARM, shared_for_s=_YOUNG_S)


class _Teller:
    """Tells everybody how far a batch is, as often as each wants to know."""

    def __init__(
        self,
        state: RunState,
        journal: Journal,
        on_progress: Callable[[BatchProgress], None] | None,
    ) -> None:
        self._state = state
        self._journal = journal
        self._on_progress = on_progress
        self._mentioned_at = 0.0

    def __call__(self, progress: BatchProgress) -> None:
        if self._on_progress is not None:
            self._on_progress(progress)
        if time.monotonic() - self._mentioned_at >= _MENTION_S:
            self._mentioned_at = time.monotonic()
            self._state.save_progress(progress)
            self._journal.mention("progress", **asdict(progress))


def _part_of(jobs: Sequence[VideoJob], shard: Shard | None) -> list[VideoJob]:
    return [job for index, job in enumerate(jobs) if shard is None or shard.holds(index)]


def planned_batch(
    jobs: Sequence[VideoJob],
    output: str | Path,
    recipe: Recipe | None = None,
    *,
    fresh: bool = False,
    shard: Shard | None = None,
) -> list[tuple[VideoJob, str | None]]:
    """Each video that `annotate_batch` would look at, and why it would work on it.

    Parameters
    ----------
    jobs, output, recipe, fresh, shard
        As of `annotate_batch`; nothing is written.

    Returns
    -------
    list of (VideoJob, str or None)
        None for those that are up to date.
    """
    output, jobs = Path(output), _part_of(jobs, shard)
    last = last_endings(RunState(output).journals)
    reasons = plan_batch(jobs, output, recipe or Recipe(), last, fresh=fresh)
    return [*zip(jobs, reasons, strict=True)]


class _Clock:
    """Wall time from when this is made."""

    def __init__(self) -> None:
        self.started_at = datetime.now(UTC).isoformat(timespec="seconds")
        self._started = time.perf_counter()

    @property
    def elapsed_s(self) -> float:
        return time.perf_counter() - self._started


def _worker_count(
    executor: Literal["process", "serial"] | VideoExecutor,
    wanted: int | None,
    jobs: Sequence[VideoJob],
    recipe: Recipe,
) -> int:
    """Processes to use at a time; 0 for none."""
    if isinstance(executor, VideoExecutor):
        return executor.capacity
    if executor == "serial":
        return 0
    most = wanted or min(core_count(), workers_for_memory(jobs, recipe))
    return min(most, max(len(jobs), 1))


def annotate_batch(
    jobs: Sequence[VideoJob],
    output: str | Path,
    recipe: Recipe | None = None,
    *,
    workers: int | None = None,
    executor: Literal["process", "serial"] | VideoExecutor = "process",
    limits: CallLimits | None = None,
    retries: int = 0,
    fresh: bool = False,
    cache: bool = True,
    shard: Shard | None = None,
    on_progress: Callable[[BatchProgress], None] | None = None,
    on_event: OnEvent | None = None,
) -> BatchReport:
    """Annotate videos, each in one process; write ``batch.json`` beside their folders.

    Videos whose outputs are there and up to date, made from the same video, boxes and recipe by
    the same version, are left as they are; so a batch that was stopped, however it was, goes on
    where it was.

    Parameters
    ----------
    jobs : sequence of VideoJob
        ``load_manifest(path).jobs``; ids unique.
    output : str or Path
        Gets a folder for each video; made when missing.
    recipe : Recipe, optional
        Defaults to the paper's tracker and all outputs.
    workers : int, optional
        Processes at a time, and cores that they may use; by default as many as there are cores,
        and fewer processes if free memory asks for it. Where there are fewer processes than cores,
        each follows tracks side by side. Results do not depend on it.
    executor : str or VideoExecutor
        ``"process"``, or ``"serial"`` to run everything in this process, one by one; or where else
        to run. It is shut down in the end.
    limits : CallLimits, optional
        When a video is given up; never by default.
    retries : int
        How often a video is tried again whose process crashed, was killed, or took too long.
    fresh : bool
        Do all videos anew.
    cache : bool
        Whether to keep what the tracker says in ``output / ".cache"``, and to use what an earlier
        run has kept there. Results do not depend on it.
    shard : Shard, optional
        Do only this part of the videos; `merge_batch` joins the reports.
    on_progress : callable, optional
        Called a few times a second with a :class:`BatchProgress`.
    on_event : callable, optional
        Called with everything that happens; see :mod:`situp_annotate.batch.journal`.

    Returns
    -------
    BatchReport
        A failed video is an outcome in it, not an exception.

    Raises
    ------
    OutputError
        If another run is at work in the output folder, something that no run has written stands
        there, or nothing can be written.
    KeyboardInterrupt
        After the workers are stopped and ``batch.json`` tells which videos are complete.

    Notes
    -----
    As everywhere with processes that are spawned, a script that calls this needs the usual
    ``if __name__ == "__main__":``.
    """
    output, recipe = Path(output), recipe or Recipe()
    jobs = _part_of(jobs, shard)
    state, clock = RunState(output, shard), _Clock()
    with state.locked(), state.open_journal(on_event) as journal:
        to_do = _prepare(jobs, state, recipe, journal, fresh=fresh)
        processes = _worker_count(executor, workers, [jobs[index] for index in to_do], recipe)
        cores = min(workers or core_count(), core_count())
        threads = max(1, cores // max(1, processes))
        scheduler = Scheduler(
            jobs,
            output,
            recipe,
            WorkOptions(threads, cache=cache, fresh=fresh),
            retries=retries,
            journal=journal,
            tell=_Teller(state, journal, on_progress),
        )
        scheduler.skip_all_but(to_do)
        facts = {"videos": len(jobs), "to_do": len(to_do), "workers": processes}
        journal.note("batch", **facts, **state.owner, **_for_merging(jobs, recipe, shard))
        interrupted = True
        try:
            if to_do:
                runner = _make_executor(executor, processes, limits or CallLimits())
                scheduler.run(to_do, runner)
            interrupted = scheduler.stopped_by is not None
        finally:
            report = BatchReport(
                outcomes=StoredOutcomes(output, scheduler.ended_in_order),
                up_to_date=len(jobs) - len(to_do),
                jobs=len(jobs),
                started_at=clock.started_at,
                elapsed_s=clock.elapsed_s,
                workers=processes,
                recipe=recipe,
                interrupted=interrupted,
                stopped_by=scheduler.stopped_by,
            )
            journal.note("ended", interrupted=interrupted, **report.counts)
            if shard is None:
                write_report(report, output)
    return report


def _prepare(
    jobs: Sequence[VideoJob], state: RunState, recipe: Recipe, journal: Journal, *, fresh: bool
) -> list[int]:
    """Tidy up after earlier runs, and find out which videos to do; the longest first."""
    if state.shard is None:
        state.forget_shards()
    remove_abandoned_folders()
    recover_staging(state.output, {BATCH_FILE, REPORT_FILE, *(job.id for job in jobs)})
    logs = state.output / LOG_FOLDER
    with writing_to(logs):
        logs.mkdir(exist_ok=True)
    reasons = plan_batch(jobs, state.output, recipe, journal.last, fresh=fresh)
    to_do = [index for index, reason in enumerate(reasons) if reason is not None]
    return sorted(to_do, key=lambda index: expected_work(jobs[index]), reverse=True)


def _for_merging(jobs: Sequence[VideoJob], recipe: Recipe, shard: Shard | None) -> dict[str, Any]:
    """What those who join shards need to know of one."""
    return {} if shard is None else {"ids": [job.id for job in jobs], "recipe": recipe.as_dict()}
