"""How far a batch is, read from its output folder by anybody, at any time."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from situp_annotate.batch.journal import Event, read_events
from situp_annotate.batch.state import RunState, Shard
from situp_annotate.errors import SitupError
from situp_annotate.outcomes import VideoFailure
from situp_annotate.progress import RunningVideo

__all__ = ["RunStatus", "read_status"]


@dataclass(frozen=True, slots=True)
class RunStatus:
    """How far a run is, or one shard of it.

    Attributes
    ----------
    shard : Shard or None
        Which part of the batch; None for all of it.
    state : str
        ``"running"``; ``"complete"``; ``"interrupted"``, on purpose or by a full disk; or
        ``"killed"``, if it has not come to its end.
    videos, done, failed : int
        All, those that are through, and how many of these failed.
    started_at : str
        ISO 8601, UTC.
    seconds_left : float or None
        Estimate for a run that goes on; None when nobody knows.
    host, pid
        Where it runs or ran.
    running : tuple of RunningVideo
        What is being worked on.
    failures : tuple of VideoFailure
        What failed, and why.
    """

    shard: Shard | None
    state: Literal["running", "complete", "interrupted", "killed"]
    videos: int
    done: int
    failed: int
    started_at: str
    seconds_left: float | None
    host: str
    pid: int
    running: tuple[RunningVideo, ...]
    failures: tuple[VideoFailure, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON data."""
        return asdict(self)


def read_status(output: Path) -> tuple[RunStatus, ...]:
    """How far the last run into an output folder is: one, or one for each shard.

    Parameters
    ----------
    output : Path
        The output folder of the batch.

    Raises
    ------
    SitupError
        If no run has begun there.
    """
    whole = RunState(output)
    states = [whole, *(RunState(output, shard) for shard in whole.shards)]
    known = tuple(status for state in states if (status := _status(state)) is not None)
    if len(known) > 1 and known[0].shard is None and known[0].started_at < known[1].started_at:
        known = known[1:]  # what ran before there were shards
    if not known:
        raise SitupError(
            f"{output}: no run has begun here; give the output folder of `situp-annotate run`."
        )
    return known


def _status(state: RunState) -> RunStatus | None:
    events = [*read_events(state.journal)]
    starts = [index for index, event in enumerate(events) if event["event"] == "batch"]
    if not starts:
        return None
    begin, since = events[starts[-1]], events[starts[-1] + 1 :]
    is_running = state.is_running
    ended = {event["video"]: event for event in since if _is_final(event)}
    failed = [event for event in ended.values() if event["event"] == "failed"]
    progress = _read_progress(state.progress) if is_running else {}
    return RunStatus(
        shard=state.shard,
        state="running" if is_running else _final_state(since),
        videos=begin["videos"],
        done=begin["videos"] - begin["to_do"] + len(ended),
        failed=len(failed),
        started_at=begin["time"],
        seconds_left=_seconds_left(begin, progress),
        host=begin["host"],
        pid=begin["pid"],
        running=tuple(RunningVideo(**video) for video in progress.get("running", ())),
        failures=tuple(
            VideoFailure(event["video"], event["path"], event["kind"], event["message"])
            for event in failed
        ),
    )


def _is_final(event: Event) -> bool:
    return event["event"] == "done" or (event["event"] == "failed" and not event["retry"])


def _final_state(since: Sequence[Event]) -> Literal["complete", "interrupted", "killed"]:
    if not since or since[-1]["event"] != "ended":
        return "killed"
    return "interrupted" if since[-1]["interrupted"] else "complete"


def _read_progress(path: Path) -> dict[str, Any]:
    try:
        progress = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return progress if isinstance(progress, dict) else {}


def _seconds_left(begin: Event, progress: dict[str, Any]) -> float | None:
    done, expected = progress.get("frames_done", 0), progress.get("frames_expected", 0)
    if not done or expected < done:
        return None
    elapsed = (datetime.now(UTC) - datetime.fromisoformat(begin["time"])).total_seconds()
    return float(elapsed * (expected - done) / done)
