"""Run the work on videos on the machines of a Dask cluster."""

import shutil
import threading
import uuid
from collections.abc import Callable, Sequence
from concurrent import futures
from concurrent.futures import Future
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from pathlib import Path
from time import monotonic, sleep
from typing import Any, TypeVar

from situp_annotate.errors import SitupError, WorkerLostError
from situp_annotate.executors.dask_call import Answer, ClusterCall, run_call
from situp_annotate.executors.dask_cluster import DaskCluster
from situp_annotate.executors.executor import VideoExecutor
from situp_annotate.executors.isolation import CallLimits
from situp_annotate.formats.disk import writing_to
from situp_annotate.types import VideoJob

__all__ = ["DaskExecutor"]

T = TypeVar("T")

_LOCK_FOLDER = Path(".run", "videos")
_WATCH_S = 1.0
_POLL_S = 0.1
_END_S = 10.0
"""For how long processes that are being ended are waited for."""


@dataclass(frozen=True, slots=True)
class _Task:
    """The id of a call, and what Dask promises for it."""

    call: str
    answer: Future[Answer]


class DaskExecutor(VideoExecutor):
    """Runs each call on a worker of a Dask cluster, there in a fresh process of its own.

    All machines have the same version of this package, and share a disk that is mounted at the
    same place: paths are made absolute, and mean the same everywhere.

    A call whose worker dies runs again on another one. Calls with a `VideoJob` never run two at a
    time for the same video, even if a worker that was given up for lost is still at it. A call
    that is cancelled, or whose client is gone, is ended on its worker.

    Parameters
    ----------
    address : str
        Of the scheduler, such as ``tcp://10.0.0.1:8786``.
    output : Path
        The output folder of the calls, on the shared disk; made when missing.
    limits : CallLimits, optional
        When a call is given up.
    preload : sequence of str
        Modules that processes need, imported once where processes are forked.

    Attributes
    ----------
    capacity : int
        Threads that the workers have at present, but at least 1.

    Raises
    ------
    SitupError
        If Dask is not installed, the scheduler does not answer, it has no workers, a machine has
        another version of this package or does not see the output folder, or this cannot be
        written. If the like happens later, futures raise it.
    """

    def __init__(
        self,
        address: str,
        output: Path,
        limits: CallLimits | None = None,
        preload: Sequence[str] = (),
    ) -> None:
        self._output = output.absolute()
        self._limits = limits or CallLimits()
        self._preload = tuple(preload)
        self._id = uuid.uuid4().hex
        self._numbers = count()
        self._tasks: dict[Future[Any], _Task] = {}
        self._frames: dict[str, tuple[int, int]] = {}
        self._refusal: SitupError | None = None
        self._over = threading.Event()
        self._cluster = DaskCluster(address, self._output)
        self._dask = self._cluster.executor()
        self.capacity = max(1, self._cluster.count_threads())
        self._watcher = threading.Thread(target=self._watch, daemon=True)
        self._watcher.start()

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:  # noqa: ANN401
        """Have Dask run the call on a worker.

        Raises
        ------
        SitupError
            If the cluster is lost or cannot be used any more, or the disk refuses.
        """
        if self._refusal is not None or not self._cluster.is_open:
            raise self._loss(None)
        id_ = f"{self._id}-{next(self._numbers)}"
        call = ClusterCall(
            id=id_,
            fn=partial(fn, **kwargs),
            args=tuple(map(_made_absolute, args)),
            lock=self._lock_for(args, id_),
            limits=self._limits,
            preload=self._preload,
        )
        task = _Task(id_, self._dask.submit(run_call, call))
        future: Future[T] = Future()
        self._tasks[future] = task
        future.add_done_callback(self._forget)
        task.answer.add_done_callback(partial(self._hand_on, future))
        return future

    def frames(self, future: Future[Any]) -> tuple[int, int]:
        """How many frames of an unfinished call are done, and how many there will be."""
        task = self._tasks.get(future)
        return self._frames.get(task.call, (0, 0)) if task else (0, 0)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let calls finish, or with ``cancel_futures`` end all of them now; leave the cluster.

        Without `wait` it is left when this process ends.
        """
        if cancel_futures:
            for future in [*self._tasks]:
                future.cancel()
        if not wait:
            return
        futures.wait([*self._tasks])
        self._over.set()
        if self._await_ends():
            shutil.rmtree(self._output / _LOCK_FOLDER, ignore_errors=True)
        self._cluster.leave()
        self._watcher.join()

    def _lock_for(self, args: Sequence[Any], call: str) -> Path:
        folder = self._output / _LOCK_FOLDER
        with writing_to(folder):
            folder.mkdir(parents=True, exist_ok=True)
        videos = (each.id for each in args if isinstance(each, VideoJob))
        return folder / f"{next(videos, call)}.lock"

    def _forget(self, future: Future[Any]) -> None:
        task = self._tasks.pop(future)
        if future.cancelled():
            task.answer.cancel()

    def _hand_on(self, future: Future[T], task: Future[Answer]) -> None:
        if not future.set_running_or_notify_cancel():
            return
        try:
            answer = task.result()
        except Exception as error:  # noqa: BLE001 - Dask's own, of whatever kind
            answer = Answer(error=self._loss(error))
        if answer.error is None:
            future.set_result(answer.value)
        else:
            future.set_exception(answer.error)

    def _loss(self, error: Exception | None) -> SitupError:
        """What it means that Dask has no answer."""
        if self._refusal is not None:
            return self._refusal
        if not self._cluster.is_open:
            return SitupError(
                f"{self._cluster.address}: this Dask scheduler is gone; start it and its workers, "
                "and run again: what is finished is kept."
            )
        return WorkerLostError(
            "It is not known what became of this video, for Dask has lost it or its worker "
            f"({error!r}); see the logs of the workers."
        )

    # ---- beside the calls --------------------------------------------------------------------

    def _watch(self) -> None:
        """Follow what goes on in the cluster, and end all calls if that makes no sense any more."""
        while not self._over.wait(_WATCH_S):
            try:
                self._look_around()
            except SitupError as error:
                self._refusal = error
                for task in [*self._tasks.values()]:
                    task.answer.cancel()
                return
            except Exception:  # noqa: BLE001 - no answer: Dask connects again, or gives up
                continue

    def _look_around(self) -> None:
        self.capacity = max(1, self._cluster.count_threads())
        self._frames = self._cluster.frames()

    def _await_ends(self) -> bool:
        """Wait for the processes of calls that were ended; whether none is left."""
        deadline = monotonic() + _END_S
        while self._cluster.is_open and monotonic() < deadline:
            try:
                left = self._cluster.frames()
            except Exception:  # noqa: BLE001 - as above
                return False
            if not any(call.startswith(self._id) for call in left):
                return True
            sleep(_POLL_S)
        return False


def _made_absolute(argument: Any) -> Any:  # noqa: ANN401
    """An argument that means the same on another machine."""
    if isinstance(argument, VideoJob):
        return replace(argument, path=argument.path.absolute())
    return argument.absolute() if isinstance(argument, Path) else argument
