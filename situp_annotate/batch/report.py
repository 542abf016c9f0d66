"""What became of a batch: ``batch.json`` and ``report.html`` of the output folder."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

from situp_annotate.batch.journal import Event
from situp_annotate.errors import EXIT_FAILED, EXIT_OK, OutputError, SitupError
from situp_annotate.formats.disk import writing_to
from situp_annotate.formats.staging import write_whole
from situp_annotate.outcomes import VideoFailure, VideoReport
from situp_annotate.overview import overview_html
from situp_annotate.pipeline import versions
from situp_annotate.recipe import Recipe
from situp_annotate.results import BATCH_FILE, REPORT_FILE, SUMMARY_FILE

__all__ = ["BatchReport", "Outcome", "StoredOutcomes", "batch_json", "write_report"]

Outcome = VideoReport | VideoFailure


class StoredOutcomes(Sequence[Outcome]):
    """What became of each video, read from its folder whenever it is asked for.

    A batch of many thousand videos would not fit into memory otherwise.

    Parameters
    ----------
    output : Path
        The output folder.
    events : sequence of Event
        How each video ended: the last ``done`` or ``failed`` of the journal.
    """

    def __init__(self, output: Path, events: Sequence[Event]) -> None:
        self._output = output
        self._events = events

    def __len__(self) -> int:
        return len(self._events)

    @overload
    def __getitem__(self, index: int) -> Outcome: ...
    @overload
    def __getitem__(self, index: slice) -> "StoredOutcomes": ...
    def __getitem__(self, index: int | slice) -> "Outcome | StoredOutcomes":
        if isinstance(index, slice):
            return StoredOutcomes(self._output, self._events[index])
        event = self._events[index]
        return _failure(event) if _has_failed(event) else self._read(event)

    def _read(self, event: Event) -> VideoReport:
        path = self._output / str(event["video"]) / SUMMARY_FILE
        try:
            known = [(key, event[key]) for key in ("cache", "seconds") if key in event]
            return VideoReport.from_dict({**json.loads(path.read_bytes()), **dict(known)})
        except (OSError, ValueError) as error:
            raise SitupError(
                f"{path}: this outcome of the batch cannot be read any more ({error}); run the "
                "batch again."
            ) from error

    @property
    def failures(self) -> tuple[VideoFailure, ...]:
        """The videos that failed."""
        return tuple(map(_failure, filter(_has_failed, self._events)))

    @property
    def failed_count(self) -> int:
        """How many failed."""
        return sum(map(_has_failed, self._events))


def _has_failed(event: Event) -> bool:
    return bool(event["event"] == "failed")


def _failure(event: Event) -> VideoFailure:
    return VideoFailure(event["video"], event["path"], event["kind"], event["message"])


@dataclass(frozen=True, slots=True)
class BatchReport:
    """What became of a batch.

    Attributes
    ----------
    outcomes : sequence of VideoReport or VideoFailure
        In the order of the jobs; of an interrupted batch only the videos that were done. Read from
        the output folder as they are asked for.
    up_to_date : int
        How many of them were complete before and were left as they are.
    jobs : int
        How many there were to be.
    started_at : str
        ISO 8601, UTC.
    elapsed_s : float
        Wall time of this run of the batch.
    workers : int
        Processes at a time; 0 for the serial executor.
    recipe : Recipe
        The settings of all videos.
    interrupted : bool
        Whether it was stopped before its end.
    stopped_by : VideoFailure or None
        The failure after which it made no sense to go on, such as a full disk.
    """

    outcomes: StoredOutcomes
    up_to_date: int
    jobs: int
    started_at: str
    elapsed_s: float
    workers: int
    recipe: Recipe
    interrupted: bool = False
    stopped_by: VideoFailure | None = None

    @property
    def failures(self) -> tuple[VideoFailure, ...]:
        """The videos that failed."""
        return self.outcomes.failures

    @property
    def exit_code(self) -> int:
        """0 when all went well, 1 when a video failed, 5 when the disk refused."""
        if self.stopped_by is not None:
            return OutputError.exit_code
        return EXIT_FAILED if self.failures else EXIT_OK

    @property
    def counts(self) -> dict[str, int]:
        """How many videos succeeded, failed, and are left."""
        failed, ended = self.outcomes.failed_count, len(self.outcomes)
        return {"succeeded": ended - failed, "failed": failed, "left": self.jobs - ended}

    def as_dict(self) -> dict[str, Any]:
        """Everything but the videos, as plain JSON data."""
        return {
            "version": 1,
            "interrupted": self.interrupted,
            **self.counts,
            "started_at": self.started_at,
            "elapsed_s": round(self.elapsed_s, 3),
            "workers": self.workers,
            "recipe": self.recipe.as_dict(),
            "versions": versions(),
        }


def _entry(outcome: Outcome) -> dict[str, Any]:
    if isinstance(outcome, VideoFailure):
        return outcome.as_dict()
    return {**outcome.as_dict(), **outcome.circumstances}


def batch_json(head: Mapping[str, Any], outcomes: Sequence[Outcome]) -> Iterator[str]:
    """Pieces of the text of ``batch.json``.

    Parameters
    ----------
    head : mapping
        All that is not the videos.
    outcomes : sequence of VideoReport or VideoFailure
        The videos; one is held at a time.
    """
    yield json.dumps(head, indent=2, ensure_ascii=False)[: -len("\n}")] + ',\n  "videos": ['
    for index, outcome in enumerate(outcomes):
        text = json.dumps(_entry(outcome), indent=2, ensure_ascii=False)
        yield (",\n    " if index else "\n    ") + text.replace("\n", "\n    ")
    yield "\n  ]\n}\n"


def write_report(report: BatchReport, output: Path) -> None:
    """Write what became of the batch, for machines and for people.

    Parameters
    ----------
    report : BatchReport
        What became of it.
    output : Path
        The output folder, which gets ``report.html`` if the recipe says so.
    """
    write_whole(output / BATCH_FILE, batch_json(report.as_dict(), report.outcomes))
    if report.recipe.outputs.report:
        page = overview_html(report.outcomes, interrupted=report.interrupted)
        write_whole(output / REPORT_FILE, page)
    else:
        with writing_to(output / REPORT_FILE):
            (output / REPORT_FILE).unlink(missing_ok=True)  # of the run that is replaced
