"""Walks through footage, and the passes of all tracks that are made on the way."""

from collections.abc import Callable, Iterable, Iterator, MutableMapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from situp_annotate.propagation.camera import CameraMotion
from situp_annotate.propagation.footage import Footage
from situp_annotate.propagation.passes import Follower, Pass, TrackerFactory
from situp_annotate.propagation.spans import PassKey
from situp_annotate.types import Frame, Keyframe

__all__ = ["PassCache", "Survey", "Walker"]

_AHEAD_BYTES = 32 * 2**20
_MOST_AHEAD = 64

PassCache = MutableMapping[PassKey, Pass]
"""Keeps passes from one call to the next; of the same video, tracker and version only."""

Shift = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Survey:
    """What one walk through the footage tells, whatever the tracks.

    Attributes
    ----------
    shifts : ndarray
        (frames, 2): how far the scene moved in x and y since the frame before, in pixels.
    """

    shifts: npt.NDArray[np.float64]

    @property
    def frame_count(self) -> int:
        """Frames of the footage."""
        return len(self.shifts)


class Walker:
    """Walks through footage and makes passes on the way: a context manager."""

    def __init__(
        self,
        threads: int,
        tracker: TrackerFactory,
        passes: PassCache,
        on_frame: Callable[[], None] | None,
    ) -> None:
        self._pool: Executor | None = ThreadPoolExecutor(threads) if threads > 1 else None
        self._tracker = tracker
        self._passes = passes
        self._on_frame = on_frame

    def __enter__(self) -> "Walker":
        return self

    def __exit__(self, *_: object) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def survey(self, footage: Footage, keys: list[list[PassKey]]) -> Survey:
        """Walk forward through everything, and see how the scene moves."""
        camera = CameraMotion()
        shifts: list[Shift] = []

        def see(frame: Frame) -> Shift:
            shifts.append(camera(frame.image))
            return shifts[-1]

        self._walk(footage.forward(), self._missing(keys), see)
        return Survey(np.array(shifts, np.float64).reshape(-1, 2))

    def forward(self, footage: Footage, keys: list[list[PassKey]], survey: Survey) -> None:
        """Walk forward as far as passes are missing."""
        missing = self._missing(keys)
        last = [
            survey.frame_count - 1 if key.last is None else key.last for m in missing for key in m
        ]
        if last:
            frames = (frame for frame in footage.forward() if frame.index <= max(last))
            self._walk(frames, missing, lambda frame: _shift(survey, frame.index))

    def backward(self, footage: Footage, keys: list[list[PassKey]], survey: Survey) -> None:
        """Walk backward through the stretches for which passes are missing."""
        missing = self._missing(keys)
        for start, stop in _stretches(key for m in missing for key in m):
            frames = footage.backward(start, stop)
            self._walk(frames, missing, lambda frame: _shift(survey, frame.index + 1, -1.0))

    def _missing(self, keys: list[list[PassKey]]) -> list[list[PassKey]]:
        return [[key for key in of_track if key not in self._passes] for of_track in keys]

    def _walk(
        self, frames: Iterable[Frame], keys: list[list[PassKey]], see: Callable[[Frame], Shift]
    ) -> None:
        """Feed every track's passes with the frames."""
        runners = [_Runner(of_track, self._tracker) for of_track in keys if of_track]
        follow = self._pool.map if self._pool is not None else map
        for batch in _batches(frames, _AHEAD_BYTES if self._pool is not None else 0):
            seen = [(frame, see(frame)) for frame in batch]
            for _ in follow(partial(_feed, seen), runners):
                pass
            if self._on_frame is not None:
                for _ in batch:
                    self._on_frame()
        for runner in runners:
            self._passes.update(runner.finish())


def _shift(survey: Survey, index: int, sign: float = 1.0) -> Shift:
    """Motion of the scene into a frame; none into the first, or past the last."""
    if not 0 < index < survey.frame_count:
        return 0.0, 0.0
    x, y = survey.shifts[index]
    return sign * float(x), sign * float(y)


def _stretches(keys: Iterable[PassKey]) -> list[tuple[int, int]]:
    """Stretches (start, stop) that backward passes cover together, the last first."""
    merged: list[tuple[int, int]] = []
    wanted = sorted(
        ((key.last, key.frame + 1) for key in keys if key.last is not None),
        reverse=True,
        key=lambda stretch: stretch[1],
    )
    for start, stop in wanted:
        if merged and stop > merged[-1][0]:
            merged[-1] = (min(start, merged[-1][0]), merged[-1][1])
        else:
            merged.append((start, stop))
    return merged


def _batches(frames: Iterable[Frame], size: int) -> Iterator[list[Frame]]:
    """Gather frames up to a number of bytes, one at least."""
    batch: list[Frame] = []
    for frame in frames:
        batch.append(frame)
        if (len(batch) + 1) * frame.image.nbytes > size or len(batch) == _MOST_AHEAD:
            yield batch
            batch = []
    if batch:
        yield batch


def _feed(seen: Sequence[tuple[Frame, Shift]], runner: "_Runner") -> None:
    for frame, shift_xy in seen:
        runner.step(frame, shift_xy)


class _Runner:
    """Makes the passes of one track that go in one direction."""

    def __init__(self, keys: Sequence[PassKey], tracker: TrackerFactory) -> None:
        self._keys = {key.frame: key for key in keys}
        self._make_tracker = tracker
        self._following: dict[PassKey, Follower] = {}
        self._done: dict[PassKey, Pass] = {}

    def step(self, frame: Frame, shift_xy: Shift) -> None:
        """Take the next frame."""
        for key, follower in list(self._following.items()):
            follower.step(frame.image, shift_xy)
            if frame.index == key.last:
                self._done[key] = self._following.pop(key).finish()
        begun = self._keys.get(frame.index)
        if begun is not None:
            keyframe = Keyframe(begun.frame, begun.box)
            self._following[begun] = Follower(
                keyframe, frame.image, self._make_tracker, search=begun.open
            )
            if begun.last == begun.frame:
                self._done[begun] = self._following.pop(begun).finish()

    def finish(self) -> dict[PassKey, Pass]:
        """All passes, those included that the footage's end cut short."""
        cut_short = {key: follower.finish() for key, follower in self._following.items()}
        return self._done | cut_short
