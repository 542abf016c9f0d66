"""A connection to a Dask cluster, and whether its machines can do our work."""

import asyncio
import os
from collections.abc import Callable, Collection
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import ExitStack
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import NamedTemporaryFile
from time import monotonic
from typing import TYPE_CHECKING

from situp_annotate.errors import SitupError
from situp_annotate.executors.dask_call import frames_by_call
from situp_annotate.formats.disk import make_folder, writing_to

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["DaskCluster"]

_PACKAGE = "situp-annotate"
_CONNECT_S = 10
_PATIENCE_S = 600
"""For how long there may be no workers: new ones may have to wait for a machine."""


class DaskCluster:
    """A cluster that somebody has started, and that goes on when it is left.

    Parameters
    ----------
    address : str
        Of the scheduler, such as ``tcp://10.0.0.1:8786``.
    output : Path
        A folder that all machines must see, absolute; made when missing.

    Attributes
    ----------
    address : str
        As given.

    Raises
    ------
    SitupError
        If Dask is not installed, the scheduler does not answer, it has no workers, a machine is
        to be refused, or the folder cannot be written.
    """

    def __init__(self, address: str, output: Path) -> None:
        self.address = address
        self._output = output
        self._accepted: set[str] = set()
        self._manned_at = monotonic()
        self._client = _connect(address)
        try:
            self._check_scheduler()
            self._wait_for_workers()
            self.count_threads()
        except BaseException:
            self.leave()
            raise

    @property
    def is_open(self) -> bool:
        """Whether the scheduler answers, or Dask still tries to reach it again."""
        return self._client.status not in ("closing", "closed")

    def executor(self) -> Executor:
        """Dask's own executor, which runs equal calls one by one."""
        executor: Executor = self._client.get_executor(pure=False)
        return executor

    def count_threads(self) -> int:
        """How many threads the workers have, after a look at those that are new.

        Raises
        ------
        SitupError
            If a worker has another version than this process or does not see the folder, this
            cannot be written, or there have been no workers for long.
        """
        threads: dict[str, int] = self._client.nthreads()
        newcomers = threads.keys() - self._accepted
        if newcomers:
            self._check_versions(newcomers)
            self._check_disk(newcomers)
        self._accepted = set(threads)
        if threads:
            self._manned_at = monotonic()
        elif monotonic() - self._manned_at > _PATIENCE_S:
            raise SitupError(
                f"{self.address}: this Dask scheduler has had no workers for {_PATIENCE_S:g} s; "
                "start some, and run again: what is finished is kept."
            )
        return sum(threads.values())

    def frames(self) -> dict[str, tuple[int, int]]:
        """Frames done and expected of each call that a worker is at, by the call's id."""
        said = self._client.run(frames_by_call, on_error="ignore")
        return {call: frames for each in said.values() for call, frames in each.items()}

    def leave(self) -> None:
        """Close the connection; what workers are still at for it, they end."""
        self._client.close()

    def _wait_for_workers(self) -> None:
        try:
            self._client.wait_for_workers(1, timeout=_CONNECT_S)
        except TimeoutError as error:
            raise SitupError(
                f"{self.address}: this Dask scheduler has no workers; start some with "
                f"`dask worker {self.address}`."
            ) from error

    def _check_scheduler(self) -> None:
        try:
            found = self._client.run_on_scheduler(version, _PACKAGE)
        except PackageNotFoundError as error:
            found = error
        _refuse_other_version(f"scheduler {self.address}", found)

    def _check_versions(self, workers: Collection[str]) -> None:
        for worker, found in self._ask(workers, version, _PACKAGE).items():
            _refuse_other_version(f"worker {worker}", found)

    def _check_disk(self, workers: Collection[str]) -> None:
        with ExitStack() as stack:
            with writing_to(self._output):
                make_folder(self._output)
                probe = stack.enter_context(NamedTemporaryFile(dir=self._output, prefix=".probe-"))
            seen = self._ask(workers, os.path.exists, probe.name)
        for worker, sees in seen.items():
            if sees is False:
                raise SitupError(
                    f"{self._output}: the Dask worker {worker} does not see this folder; it must "
                    "be on a disk that all machines share, mounted at the same place."
                )

    def _ask(
        self, workers: Collection[str], fn: Callable[[str], object], argument: str
    ) -> dict[str, object]:
        """What a function returns on each worker, or what it raises; or why there is no answer."""
        said: dict[str, object] = self._client.run(
            fn, argument, workers=[*workers], on_error="return"
        )
        return said


def _refuse_other_version(machine: str, found: object) -> None:
    """Refuse a machine on which `version` has found another one, or none."""
    own = version(_PACKAGE)
    if found == own or not isinstance(found, str | PackageNotFoundError):
        return
    what = f"version {found}" if isinstance(found, str) else "no version"
    raise SitupError(
        f"The Dask {machine} has {what} of situp-annotate, and this process has {own}; install "
        "the same version on all machines."
    )


def _connect(address: str) -> "Client":
    try:
        from distributed import Client
    except ModuleNotFoundError as error:
        raise SitupError(
            "Dask is not installed here; install it with `pip install 'situp-annotate[dask]'`, as "
            "on all machines of the cluster."
        ) from error
    try:
        with ThreadPoolExecutor(1) as thread:  # since this one may have an event loop, in Jupyter
            thread.submit(asyncio.run, _knock(address)).result()
        return Client(address, timeout=_CONNECT_S, set_as_default=False)
    except Exception as error:
        reason = str(error) or f"nothing for {_CONNECT_S} s"
        raise SitupError(
            f"{address}: no Dask scheduler answers here ({reason}); give the address that "
            "`dask scheduler` prints, such as tcp://10.0.0.1:8786."
        ) from error


async def _knock(address: str) -> None:
    """See that Dask answers: a client would wait for ever for the answer of anything else."""
    from distributed import Security
    from distributed.comm import connect

    options = Security().get_connection_args("client")
    comm = await asyncio.wait_for(connect(address, timeout=_CONNECT_S, **options), _CONNECT_S)
    await comm.close()
