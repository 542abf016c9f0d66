"""Run the work on videos in this very process."""

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

from situp_annotate.executors.executor import VideoExecutor

__all__ = ["SerialExecutor"]

T = TypeVar("T")


class SerialExecutor(VideoExecutor):
    """Runs each call at once, in this process: for tests, debuggers and one small video."""

    capacity = 1

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:  # noqa: ANN401
        """Run the call; its future is done when this returns."""
        future: Future[T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001 - a future hands on whatever was raised
            future.set_exception(error)
        return future

    def frames(self, future: Future[Any]) -> tuple[int, int]:  # noqa: ARG002
        """Nothing: no call is unfinished when anybody can ask."""
        return 0, 0
