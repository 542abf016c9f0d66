"""What studies over many targets share: processes to work in, and keys of what they keep."""

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed
from functools import cache
from pathlib import Path
from typing import TypeVar

import cv2
import numpy as np
import numpy.typing as npt

import situp_annotate
from situp_annotate.compiling import compile_kernels
from situp_annotate.executors import ProcessExecutor
from situp_annotate.video.image_folder import list_images

__all__ = ["carry_out", "code_digest", "part_key"]

Task = TypeVar("Task")
Result = TypeVar("Result")


@cache
def code_digest(packages: tuple[str, ...], modules: tuple[str, ...]) -> str:
    """Hash of the code and tables that figures depend on; versions change less often.

    Parameters
    ----------
    packages : tuple of str
        Of `situp_annotate`, with all that is in them.
    modules : tuple of str
        Of `situp_annotate.evaluation`.
    """
    root = Path(situp_annotate.__file__).parent
    paths = [
        path
        for name in packages
        for path in sorted((root / name).rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    ]
    paths += [root / "evaluation" / f"{name}.py" for name in modules]
    return hashlib.sha256(b"".join(path.read_bytes() for path in paths)).hexdigest()


def part_key(folder: Path, truth: npt.NDArray[np.float64], *state: object) -> str:
    """Hash of everything that a part depends on.

    Parameters
    ----------
    folder : Path
        Of the sequence, whose pictures count by name and size.
    truth : ndarray
        (n, 4), of the target.
    state : object
        What else there is, as can be written as JSON.
    """
    images = [(path.name, path.stat().st_size) for path in list_images(folder)]
    text = json.dumps([situp_annotate.__version__, *state, images, truth.tolist()])
    return hashlib.sha256(text.encode()).hexdigest()


def carry_out(
    work: Callable[[Task], Result],
    tasks: Sequence[Task],
    frames: Callable[[Task], int],
    workers: int | None,
) -> Iterator[Result]:
    """Work on tasks, and yield what comes of each as soon as it is there.

    Parameters
    ----------
    work : callable
        A function of a module.
    tasks : sequence
        What it is given.
    frames : callable
        How long a task is.
    workers : int or None
        Tasks at a time, each in a fresh process of one core; None for in this one, one after
        another.

    Raises
    ------
    SitupError
        If a worker process dies; or whatever the work raises.
    """
    if workers is None:
        yield from map(work, tasks)
        return
    compile_kernels()
    pool = ProcessExecutor(workers, preload=[work.__module__])
    try:
        # The longest first, so that no worker is left alone with one at the end.
        ordered = sorted(tasks, key=frames, reverse=True)
        for future in as_completed([pool.submit(_work_alone, work, task) for task in ordered]):
            yield future.result()
    finally:
        pool.shutdown(cancel_futures=True)


def _work_alone(work: Callable[[Task], Result], task: Task) -> Result:
    """What a worker does: it has one core."""
    cv2.setNumThreads(1)
    return work(task)
