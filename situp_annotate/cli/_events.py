"""What a run tells while it goes on: a bar, a line an event, and JSON for machines."""

import json
import sys
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from datetime import datetime
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import click

from situp_annotate.errors import OutputError

if TYPE_CHECKING:
    from tqdm import tqdm

    from situp_annotate.progress import BatchProgress

__all__ = ["Events", "shown_events"]


class Events:
    """Shows what happens in a batch.

    Parameters
    ----------
    verbosity : int
        -1 for failures only, 0 for a bar too, 1 for a line an event too.
    log : file or None
        Gets every event as a line of JSON.
    bar : tqdm
        Shows the frames.

    Attributes
    ----------
    last : dict
        The event that came last.
    """

    def __init__(self, verbosity: int, log: IO[str] | None, bar: "tqdm[Any]") -> None:
        self.last: dict[str, Any] = {}
        self._verbosity = verbosity
        self._log = log
        self._bar = bar

    def on_progress(self, progress: "BatchProgress") -> None:
        """Move the bar."""
        self._bar.total = progress.frames_expected or None
        failed = f", {progress.failed} failed" if progress.failed else ""
        done = f"{progress.videos_done}/{progress.videos} videos{failed}"
        self._bar.set_postfix_str(done, refresh=False)
        self._bar.update(progress.frames_done - self._bar.n)

    def on_event(self, event: dict[str, Any]) -> None:
        """Write a line, if the event is worth one."""
        self.last = event
        if self._log is not None:
            self._log.write(json.dumps(event, ensure_ascii=False) + "\n")
            self._log.flush()
        level, text = _line(event)
        if text and level <= self._verbosity:
            time = datetime.fromisoformat(event["time"]).astimezone()
            self._bar.clear()
            click.echo(f"{time:%H:%M:%S} {text}", err=True)


def _line(event: dict[str, Any]) -> tuple[int, str]:
    """From which verbosity on an event is told, and how."""
    kind, video = event["event"], event.get("video")
    if kind == "failed":
        again = " Trying again." if event["retry"] else ""
        return -1, f"{video}: failed ({event['kind']}): {event['message']}{again}"
    if kind == "started":
        again = f", attempt {event['attempt']}" if event["attempt"] > 1 else ""
        return 1, f"{video}: started{again}"
    if kind == "done":
        seconds = event["seconds"].get("total")
        took = "was up to date" if seconds is None else f"done in {seconds:.1f} s"
        return 1, f"{video}: {took}, {event['frames']} frames"
    if kind == "batch":
        ready = event["videos"] - event["to_do"]
        kept = f", {ready} are up to date" if ready else ""
        at_a_time = f", {event['workers']} at a time" if event["workers"] > 1 else ""
        return 1, f"{event['to_do']} of {event['videos']} videos to do{at_a_time}{kept}"
    return 1, ""


@contextmanager
def shown_events(verbosity: int, log_json: Path | None) -> "Iterator[Events]":
    """Show what happens in the context, the bar on stderr if that is a terminal.

    Raises
    ------
    OutputError
        If the log cannot be written.
    """
    from tqdm import tqdm

    with ExitStack() as stack:
        log = None if log_json is None else stack.enter_context(_opened(log_json))
        hidden = True if verbosity < 0 else None
        bar: tqdm[Any] = tqdm(unit="frame", disable=hidden, dynamic_ncols=True)
        stack.enter_context(closing(bar))
        yield Events(verbosity, log, bar)


@contextmanager
def _opened(path: Path) -> Iterator[IO[str]]:
    if str(path) == "-":
        yield sys.stdout
        return
    try:
        file = path.open("a", encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}.") from error
    with file:
        yield file
