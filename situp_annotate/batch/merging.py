"""Join what became of the shards of a batch."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import chain, zip_longest
from pathlib import Path

from situp_annotate.batch.journal import Event, last_endings, read_events
from situp_annotate.batch.report import BatchReport, StoredOutcomes, write_report
from situp_annotate.batch.state import RunState, Shard
from situp_annotate.errors import SitupError
from situp_annotate.recipe import recipe_from_dict

__all__ = ["merge_batch"]


@dataclass(frozen=True, slots=True)
class _ShardRun:
    """The last run of a shard: how it began and ended, and what became of its videos."""

    begin: Event
    end: Event
    endings: Sequence[Event | None]

    @property
    def elapsed_s(self) -> float:
        times = [datetime.fromisoformat(event["time"]) for event in (self.begin, self.end)]
        return (times[1] - times[0]).total_seconds()


def merge_batch(output: str | Path) -> BatchReport:
    """Write ``batch.json`` and ``report.html`` of a batch that was run in shards.

    Parameters
    ----------
    output : str or Path
        The output folder that all shards have written into.

    Returns
    -------
    BatchReport
        As one run of the whole batch would have returned it; its time is that of the longest.

    Raises
    ------
    OutputError
        If a shard is still running, or nothing can be written.
    SitupError
        If a shard is missing or has not come to its end.
    """
    output = Path(output)
    state = RunState(output)
    shards = _shards(state)
    with state.locked():
        runs = [_read(RunState(output, shard)) for shard in shards]
        # The first of each shard, then the second of each: the order of the manifest.
        endings = chain.from_iterable(zip_longest(*(run.endings for run in runs)))
        report = BatchReport(
            outcomes=StoredOutcomes(output, [event for event in endings if event is not None]),
            up_to_date=0,
            jobs=sum(run.begin["videos"] for run in runs),
            started_at=min(run.begin["time"] for run in runs),
            elapsed_s=max(run.elapsed_s for run in runs),
            workers=sum(run.begin["workers"] for run in runs),
            recipe=recipe_from_dict(runs[0].begin["recipe"]),
            interrupted=any(run.end["interrupted"] for run in runs),
        )
        write_report(report, output)
    return report


def _shards(state: RunState) -> list[Shard]:
    """All shards of the batch, in order."""
    found = state.shards
    if not found:
        raise SitupError(
            f"{state.output}: no shard has run here; `situp-annotate run --shard 1/4` runs the "
            "first of four."
        )
    counts = {shard.count for shard in found}
    if len(counts) > 1:
        raise SitupError(
            f"{state.output}: shards of different batches have run here "
            f"({', '.join(map(str, found))}); run the manifest once without --shard, which finds "
            "what is done."
        )
    missing = {*range(1, max(counts) + 1)} - {shard.number for shard in found}
    if missing:
        number = min(missing)
        raise SitupError(
            f"{state.output}: shard {Shard(number, max(counts))} has not run here; run it first."
        )
    return found


def _read(state: RunState) -> _ShardRun:
    events = [*read_events(state.journal)]
    begin = next((event for event in reversed(events) if event["event"] == "batch"), None)
    if begin is None or events[-1]["event"] != "ended":
        raise SitupError(
            f"{state.output}: shard {state.shard} has not come to its end; run it again, it will "
            "go on where it was."
        )
    last = last_endings([state.journal])
    return _ShardRun(begin, events[-1], [last.get(video) for video in begin["ids"]])
