"""Where a run keeps its state in the output folder, and that no other run is at it."""

import json
import os
import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from filelock import FileLock, Timeout

from situp_annotate.batch.journal import Journal, OnEvent
from situp_annotate.errors import OutputError
from situp_annotate.formats.disk import writing_to
from situp_annotate.progress import BatchProgress
from situp_annotate.results import BATCH_FILE, LOG_FOLDER, REPORT_FILE

__all__ = ["STATE_FOLDER", "RunState", "Shard"]

STATE_FOLDER = ".run"
"""Beside the folders of the videos, none of whose names can start with a dot."""

_SHARD_JOURNAL = re.compile(r"journal-(\d+)-of-(\d+)\.jsonl")


@dataclass(frozen=True, slots=True)
class Shard:
    """One of several equal parts of a batch that run on their own, say on other machines.

    Attributes
    ----------
    number, count : int
        Which part, from 1, and of how many.
    """

    number: int
    count: int

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    def holds(self, index: int) -> bool:
        """Whether the video at this place of the manifest is in this part."""
        return index % self.count == self.number - 1


@dataclass(frozen=True, slots=True)
class RunState:
    """The files of a run, or of one shard, in ``.run`` of the output folder.

    Attributes
    ----------
    output : Path
        The output folder.
    shard : Shard or None
        The part of the batch; None for the whole.
    """

    output: Path
    shard: Shard | None = None

    @property
    def folder(self) -> Path:
        """``.run``."""
        return self.output / STATE_FOLDER

    def _path(self, name: str, suffix: str) -> Path:
        part = f"-{self.shard.number}-of-{self.shard.count}" if self.shard else ""
        return self.folder / f"{name}{part}{suffix}"

    @property
    def lock(self) -> Path:
        """Held as long as the run goes on."""
        return self._path("run", ".lock")

    @property
    def journal(self) -> Path:
        """What happens; see :mod:`situp_annotate.batch.journal`."""
        return self._path("journal", ".jsonl")

    @property
    def progress(self) -> Path:
        """How far the run is; replaced every second."""
        return self._path("progress", ".json")

    @property
    def owner(self) -> dict[str, int | str]:
        """Who runs: this process."""
        return {"pid": os.getpid(), "host": socket.gethostname()}

    def open_journal(self, listener: OnEvent | None) -> Journal:
        """Start the journal after those of earlier runs, of shards too.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        return Journal(self.journal, self.journals, listener)

    @property
    def journals(self) -> list[Path]:
        """The journals of all runs, of shards too."""
        return sorted(self.folder.glob("journal*.jsonl"))

    @property
    def shards(self) -> list[Shard]:
        """The shards that have begun here, in order."""
        matches = (_SHARD_JOURNAL.fullmatch(path.name) for path in self.journals)
        found = (Shard(int(match[1]), int(match[2])) for match in matches if match)
        return sorted(found, key=lambda shard: (shard.count, shard.number))

    def forget_shards(self) -> None:
        """Drop what shards have left, once it stands in the journal of the whole."""
        for shard in self.shards:
            part = RunState(self.output, shard)
            for path in (part.journal, part.progress, part.lock):
                path.unlink(missing_ok=True)

    def save_progress(self, progress: BatchProgress) -> None:
        """Let `status` know how far the run is; a disk that refuses matters elsewhere."""
        said = {**self.owner, **asdict(progress)}
        partial = self.progress.with_suffix(".partial")
        with suppress(OSError):
            partial.write_text(json.dumps(said, ensure_ascii=False), encoding="utf-8")
            partial.replace(self.progress)

    @property
    def is_running(self) -> bool:
        """Whether a run holds the lock."""
        return self.lock.exists() and _is_held(self.lock)

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Keep other runs out of the output folder, except for other shards of as many.

        Raises
        ------
        OutputError
            If a run is at it, or the folder cannot be written.
        """
        self._refuse_foreign()
        lock = FileLock(self.lock, timeout=0)
        with writing_to(self.output):
            self.folder.mkdir(parents=True, exist_ok=True)
            try:
                lock.acquire()
            except Timeout as error:
                raise self._refusal(self.lock) from error
        with lock:
            for other in self.folder.glob("run*.lock"):
                if other != self.lock and not self._may_run_beside(other) and _is_held(other):
                    raise self._refusal(other)
            yield

    def _refuse_foreign(self) -> None:
        """Stop if a run would replace what no run has written."""
        if self.output.exists() and not self.output.is_dir():
            raise OutputError(f"{self.output}: the output must be a folder, but a file is there.")
        if self.folder.exists():
            return
        for name in (BATCH_FILE, REPORT_FILE, LOG_FOLDER):
            if (self.output / name).exists():
                raise OutputError(
                    f"{self.output}: {name} is already there, and not of a run that could be gone "
                    "on with; move it away, or choose another output folder."
                )

    def _may_run_beside(self, lock: Path) -> bool:
        return self.shard is not None and lock.stem.endswith(f"-of-{self.shard.count}")

    def _refusal(self, lock: Path) -> OutputError:
        who = ""
        with suppress(OSError, ValueError, KeyError, TypeError):
            name = lock.name.replace("run", "progress", 1).replace(".lock", ".json")
            said = json.loads((self.folder / name).read_bytes())
            who = f" (process {said['pid']} on {said['host']})"
        return OutputError(
            f"{self.output}: another run is at work here{who}; wait for its end, or choose another "
            "output folder. `situp-annotate status` shows how far it is."
        )


def _is_held(lock: Path) -> bool:
    try:
        with FileLock(lock, timeout=0):
            return False
    except (Timeout, OSError):
        return True
