"""Trackers × targets × protocols in processes; what is finished is kept."""

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import cv2
from pydantic import TypeAdapter, ValidationError

import situp_annotate
from situp_annotate.compiling import compile_kernels, load_kernels
from situp_annotate.errors import SitupError
from situp_annotate.evaluation.benchmark import Target
from situp_annotate.evaluation.tracker_runs import Run, run_target
from situp_annotate.executors import ProcessExecutor
from situp_annotate.formats.staging import write_whole
from situp_annotate.trackers import folder_name, make_tracker, model_files
from situp_annotate.video.image_folder import list_images

__all__ = ["Part", "PartName", "run_benchmark"]

_RUNNING = ("otb_frames", "robustness", "tracker_runs")
"""Modules beside this one that boxes depend on."""


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
        images = [(path.name, path.stat().st_size) for path in list_images(self.target.folder)]
        models = [_file_digest(path) for path in model_files(self.name.tracker)]
        state = [situp_annotate.__version__, _code_digest(), self.name.tracker, self.name.protocol]
        text = json.dumps([*state, models, images, self.target.truth.tolist()])
        return hashlib.sha256(text.encode()).hexdigest()


@cache
def _file_digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@cache
def _code_digest() -> str:
    """Hash of the trackers' code, with their settings, and of what runs them."""
    package = Path(situp_annotate.__file__).parent
    paths = [
        path
        for name in ("trackers", "tracking")
        for path in sorted((package / name).rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    ]
    paths += [package / "evaluation" / f"{name}.py" for name in _RUNNING]
    return hashlib.sha256(b"".join(path.read_bytes() for path in paths)).hexdigest()


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
    for name, part, was_there in _carry_out(tasks, workers):
        found[name] = part
        if on_part is not None:
            on_part(was_there)
    return {name: found[name] for name in names}


def _carry_out(
    tasks: Sequence[_Task], workers: int | None
) -> Iterator[tuple[PartName, Part, bool]]:
    if workers is None:
        yield from map(_finish, tasks)
        return
    compile_kernels()
    pool = ProcessExecutor(workers, preload=[__name__])
    try:
        # The longest first, so that no worker is left alone with one at the end.
        ordered = sorted(tasks, key=lambda task: -len(task.target.truth))
        for future in as_completed([pool.submit(_finish_alone, task) for task in ordered]):
            yield future.result()
    finally:
        pool.shutdown(cancel_futures=True)


def _finish_alone(task: _Task) -> tuple[PartName, Part, bool]:
    """What a worker does: it has one core."""
    cv2.setNumThreads(1)
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
