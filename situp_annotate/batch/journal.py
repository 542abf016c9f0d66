"""What happens in a batch, as lines of JSON: for the next run, for `status`, and for machines.

Every event is an object with ``time`` (ISO 8601, UTC) and ``event``, one of

``batch``
    A run begins: ``videos``, how many of them are ``to_do``, ``workers``, ``host``, ``pid``.
``started``
    Work on a video begins: ``video``, ``attempt``.
``done``
    A video is complete: ``video``, ``frames``, ``seconds`` by stage, ``cache``, and ``stamp``,
    the size and time stamp of the video file.
``failed``
    A video failed: ``video``, ``path``, ``kind``, ``message``, ``attempt``, ``retry``.
``progress``
    Every second, only for those who listen, not in the journal: the attributes of
    :class:`~situp_annotate.progress.BatchProgress`.
``ended``
    The run is over: ``succeeded``, ``failed``, ``left``, ``interrupted``.
"""

import json
from collections.abc import Callable, Iterable, Iterator
from datetime import UTC, datetime
from itertools import chain
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from situp_annotate.formats.disk import writing_to
from situp_annotate.formats.staging import write_whole

__all__ = ["Event", "Journal", "OnEvent", "last_endings", "read_events"]

Event = dict[str, Any]
OnEvent = Callable[[Event], None]

_LASTING = ("done", "failed")


def read_events(path: Path) -> Iterator[Event]:
    """Events of a journal; a line that was cut off by a kill is left out.

    Parameters
    ----------
    path : Path
        The file; one that is not there holds no events.
    """
    try:
        lines = path.read_bytes().splitlines()
    except OSError:
        return
    for line in lines:
        try:
            event = json.loads(line)
        except ValueError:
            continue
        if isinstance(event, dict) and isinstance(event.get("event"), str):
            yield event


def last_endings(paths: Iterable[Path]) -> dict[str, Event]:
    """How each video ended when it was last worked on, by its id, from these journals."""
    return {
        event["video"]: event
        for event in chain.from_iterable(map(read_events, paths))
        if event["event"] in _LASTING and isinstance(event.get("video"), str)
    }


class Journal:
    """Takes down what happens, after what is worth keeping of earlier runs.

    Parameters
    ----------
    path : Path
        The file; its folder exists.
    earlier : iterable of Path
        More files that earlier runs have written.
    listener : callable, optional
        Told every event too.

    Attributes
    ----------
    last : dict of str to Event
        How each video ended when it was last worked on, by its id.

    Raises
    ------
    OutputError
        If it cannot be written.
    """

    def __init__(
        self, path: Path, earlier: Iterable[Path] = (), listener: OnEvent | None = None
    ) -> None:
        self.last = last_endings([*earlier, path])
        self._listener = listener or (lambda _: None)
        self._path = path
        write_whole(path, b"".join(map(_line, self.last.values())))
        with writing_to(path):
            self._file = path.open("ab", buffering=0)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._file.close()

    def note(self, event: str, **details: Any) -> Event:  # noqa: ANN401
        """Take down an event, and return it.

        Raises
        ------
        OutputError
            If the disk refuses.
        """
        said = self.mention(event, **details)
        if event in _LASTING:
            self.last[details["video"]] = said
        with writing_to(self._path):
            self._file.write(_line(said))
        return said

    def mention(self, event: str, **details: Any) -> Event:  # noqa: ANN401
        """Tell an event only who listens, and return it."""
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        said = {"time": now, "event": event, **details}
        self._listener(said)
        return said


def _line(event: Event) -> bytes:
    return json.dumps(event, ensure_ascii=False).encode() + b"\n"
