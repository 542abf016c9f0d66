"""Trackers × targets × protocols in processes; what is finished is kept."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from situp_annotate.compiling import load_kernels
from situp_annotate.errors import SitupError
from situp_annotate.evaluation.benchmark import Target
from situp_annotate.evaluation.studies import carry_out, code_digest, part_key
from situp_annotate.evaluation.tracker_runs import Run, run_target
from situp_annotate.formats.staging import write_whole
from situp_annotate.trackers import folder_name, make_tracker, model_files

__all__ = ["Part", "PartName", "run_benchmark"]

_PACKAGES = ("trackers", "tracking")
_RUNNING = ("otb_frames", "robustness", "tracker_runs")
"""Packages, and modules beside this one, that boxes depend on."""


@dataclass(frozen=True, slots=True)
class PartName:
    """What is run: a tracker, on a target, by a protocol."""

    tracker: str
    target: str
    protocol: str


@dataclass(frozen=True, slots=True)
class Part:
    """What came out.

    Attributes
    ----------
    key : str
        Hash of everything that the boxes depend on.
    runs : tuple of Run
        In the order of the protocol.
    """

    key: str
    runs: tuple[Run, ...]


_PART: TypeAdapter[Part] = TypeAdapter(Part)


@dataclass(frozen=True, slots=True)
class _Task:
    """What a worker is given."""

    name: PartName
    target: Target
    parts: Path
    fresh: bool

    @property
    def path(self) -> Path:
        folder = self.parts / folder_name(self.name.tracker)
        return folder / f"{self.name.target}.{self.name.protocol}.json"

    def key(self) -> str:
        assert self.target.folder is not None, "checked before anything is run"
        models = [_file_digest(path) for path in model_files(self.name.tracker)]
        state = (code_digest(_PACKAGES, _RUNNING), self.name.tracker, self.name.protocol, models)
        return part_key(self.target.folder, self.target.truth, *state)


@cache
def _file_digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def run_benchmark(
    names: Sequence[PartName],
    targets: Sequence[Target],
    parts: Path,
    *,
    workers: int | None = None,
    fresh: bool = False,
    on_part: Callable[[bool], object] | None = None,
) -> dict[PartName, Part]:
    """Run what is not there yet.

    Parameters
    ----------
    names : sequence of PartName
        What to run.
    targets : sequence of Target
        All that are named, with folders of pictures.
    parts : Path
        Folder that gets a file for each name; made if need be.
    workers : int, optional
        Names at a time, in processes of one thread each; by default in this one, one after
        another.
    fresh : bool
        Whether to run what is there already, too: speeds are then of the same time.
    on_part : callable, optional
        Called as soon as a part is there: whether it was there before.

    Raises
    ------
    SitupError
        If a target cannot be read, a tracker fails, or a worker process dies.
    """
    by_name = {target.name: target for target in targets}
    tasks = [_Task(name, by_name[name.target], parts, fresh) for name in names]
    found: dict[PartName, Part] = {}
    work = _finish if workers is None else _finish_alone
    done = carry_out(work, tasks, lambda task: len(task.target.truth), workers)
    for name, part, was_there in done:
        found[name] = part
        if on_part is not None:
            on_part(was_there)
    return {name: found[name] for name in names}


def _finish_alone(task: _Task) -> tuple[PartName, Part, bool]:
    """What a worker does."""
    load_kernels()  # loading them is no part of a tracker's speed
    return _finish(task)


def _finish(task: _Task) -> tuple[PartName, Part, bool]:
    part = None if task.fresh else _read(task)
    return task.name, part or _run(task), part is not None


def _read(task: _Task) -> Part | None:
    """A part that is there, if it still holds."""
    try:
        part = _PART.validate_json(task.path.read_bytes())
    except (OSError, ValidationError):
        return None
    return part if part.key == task.key() else None


def _run(task: _Task) -> Part:
    make = partial(make_tracker, task.name.tracker)
    try:
        runs = run_target(make, task.target, task.name.protocol)
    except SitupError as error:
        raise SitupError(f"{task.name.tracker}: {error}") from error
    part = Part(task.key(), tuple(runs))
    write_whole(task.path, _PART.dump_json(part) + b"\n")
    return part
