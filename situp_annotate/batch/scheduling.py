"""Give out videos to an executor, take outcomes, try again where that helps."""

import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, replace
from pathlib import Path

from situp_annotate.batch.journal import Event, Journal
from situp_annotate.batch.resuming import complete_report
from situp_annotate.batch.tally import Tally
from situp_annotate.batch.worker import VideoDone, WorkOptions, annotate_job
from situp_annotate.errors import DiskError, WorkerError, WorkerLostError
from situp_annotate.executors import VideoExecutor
from situp_annotate.formats.disk import writing_to
from situp_annotate.formats.staging import discard_staging
from situp_annotate.outcomes import VideoFailure
from situp_annotate.progress import BatchProgress, RunningVideo
from situp_annotate.recipe import Recipe
from situp_annotate.results import LOG_FOLDER
from situp_annotate.types import VideoJob

__all__ = ["Scheduler"]

_POLL_S = 0.2
_RETRIES_IF_LOST = 3  # which is never the video's fault
_RETRIABLE = frozenset({"crashed", "killed", "timed_out", "stalled"})

_Future = Future[VideoDone | VideoFailure]


@dataclass(frozen=True, slots=True)
class _Task:
    """Work on a video that is to be done, or since some time is being done."""

    index: int
    attempt: int = 1
    since: float = 0.0


class Scheduler:
    """Gets videos worked on.

    Parameters
    ----------
    jobs : sequence of VideoJob
        All videos of the batch.
    output : Path
        The output folder.
    recipe : Recipe
        The settings of all videos.
    options : WorkOptions
        How to work on them.
    retries : int
        How often a video is tried again whose process crashed, was killed, or took too long.
    journal : Journal
        Told what happens.
    tell : callable
        Called a few times a second with how far the batch is.

    Attributes
    ----------
    ended : dict of int to Event
        How each video that is through has ended, by its place among the jobs.
    stopped_by : VideoFailure or None
        A failure after which it made no sense to go on.
    """

    def __init__(
        self,
        jobs: Sequence[VideoJob],
        output: Path,
        recipe: Recipe,
        options: WorkOptions,
        *,
        retries: int,
        journal: Journal,
        tell: Callable[[BatchProgress], None],
    ) -> None:
        self.ended: dict[int, Event] = {}
        self.stopped_by: VideoFailure | None = None
        self._jobs = jobs
        self._output = output
        self._recipe = recipe
        self._options = options
        self._retries = retries
        self._journal = journal
        self._tell = tell
        self._tally = Tally(len(jobs))
        self._to_do: deque[_Task] = deque()
        self._running: dict[_Future, _Task] = {}

    @property
    def ended_in_order(self) -> list[Event]:
        """How the videos that are through have ended, in the order of the jobs."""
        return [self.ended[index] for index in sorted(self.ended)]

    def skip_all_but(self, indices: Sequence[int]) -> None:
        """Leave all videos but these as they are: their outputs are up to date."""
        for index in {*range(len(self._jobs))} - {*indices}:
            self.ended[index] = self._journal.last[self._jobs[index].id]
            self._tally.skip()

    def run(self, indices: Sequence[int], executor: VideoExecutor) -> None:
        """Work on these videos, starting with the first; leaves no work going on behind it."""
        self._to_do.extend(map(_Task, indices))
        try:
            while self._to_do or self._running:
                while self._to_do and len(self._running) < executor.capacity:
                    self._give_out(self._to_do.popleft(), executor)
                done, _ = wait(self._running, timeout=_POLL_S, return_when=FIRST_COMPLETED)
                for future in done:
                    self._collect(future)
                self._tell(self._progress(executor))
        finally:
            executor.shutdown(cancel_futures=True)
            for future in [*self._running]:
                self._settle(future)

    def _give_out(self, task: _Task, executor: VideoExecutor) -> None:
        job = self._jobs[task.index]
        log = self._output / LOG_FOLDER / f"{job.id}.log"
        if task.attempt == 1:
            with writing_to(log):
                log.unlink(missing_ok=True)
        self._journal.note("started", video=job.id, attempt=task.attempt)
        arguments = (job, self._output, self._recipe, self._options, log)
        future = executor.submit(annotate_job, *arguments)
        self._running[future] = replace(task, since=time.monotonic())

    def _collect(self, future: _Future) -> None:
        task = self._running.pop(future)
        job = self._jobs[task.index]
        try:
            outcome = future.result()
        except WorkerError as error:
            discard_staging(self._output / job.id)
            outcome = VideoFailure.of(job, error)
        if isinstance(outcome, VideoDone):
            self._note_done(task, outcome)
        else:
            self._note_failed(task, outcome)

    def _note_done(self, task: _Task, done: VideoDone) -> None:
        report = done.report
        self._tally.end(frames=done.frames_walked, failed=False)
        details = {"frames": report.frames, "stamp": done.stamp, **report.circumstances}
        self.ended[task.index] = self._journal.note("done", video=report.id, **details)

    def _note_failed(self, task: _Task, failure: VideoFailure) -> None:
        limit = _RETRIES_IF_LOST if failure.kind == WorkerLostError.kind else self._retries
        can_help = failure.kind in _RETRIABLE or failure.kind == WorkerLostError.kind
        retry = can_help and task.attempt <= limit
        facts = {"path": failure.path, "kind": failure.kind, "message": failure.message}
        event = self._journal.note(
            "failed", video=failure.id, attempt=task.attempt, retry=retry, **facts
        )
        if retry:
            self._to_do.append(_Task(task.index, task.attempt + 1))
            return
        self._tally.end(frames=0, failed=True)
        self.ended[task.index] = event
        if failure.kind == DiskError.kind:
            self.stopped_by = failure
            self._to_do.clear()

    def _settle(self, future: _Future) -> None:
        """Find out what became of a video whose process was stopped."""
        if future.done() and not future.cancelled() and future.exception() is None:
            self._collect(future)
            return
        task = self._running.pop(future)
        job = self._jobs[task.index]
        discard_staging(self._output / job.id)
        report = complete_report(job, self._output, self._recipe)
        if report is not None:
            self._note_done(task, VideoDone(report, None, 0))

    def _progress(self, executor: VideoExecutor) -> BatchProgress:
        now = time.monotonic()
        running = tuple(
            RunningVideo(self._jobs[task.index].id, *executor.frames(future), now - task.since)
            for future, task in self._running.items()
        )
        return self._tally.progress(running)
