"""Where the time of a video goes, and how far the work on it has come."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager

from situp_annotate.propagation import Footage, PassCache, PassKey, PropagationOptions
from situp_annotate.propagation.spans import backward_passes, forward_passes
from situp_annotate.types import Extend, Frame, Method, Track

__all__ = ["FrameProgress", "OnProgress", "Stopwatch", "TimedFootage", "frames_to_walk"]

OnProgress = Callable[[int, int | None], None]
"""Called with the frames walked through so far and how many there will be, if that is known."""


class Stopwatch:
    """Adds up the seconds spent in each stage."""

    def __init__(self) -> None:
        self._started = time.perf_counter()
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count what is done in this context for a stage."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start

    def timed(self, name: str, frames: Iterable[Frame]) -> Iterator[Frame]:
        """Pass frames on, counting how long each takes to come."""
        iterator = iter(frames)
        while True:
            with self.stage(name):
                frame = next(iterator, None)
            if frame is None:
                return
            yield frame

    def finish(self) -> dict[str, float]:
        """Seconds by stage and in total; what no stage claims is tracking."""
        total = time.perf_counter() - self._started
        return {**self.seconds, "track": total - sum(self.seconds.values()), "total": total}


class TimedFootage:
    """Footage whose reading is counted as ``decode`` forward, and as ``rewind`` backward."""

    def __init__(self, footage: Footage, watch: Stopwatch) -> None:
        self._footage = footage
        self._watch = watch

    @property
    def size_hw(self) -> tuple[int, int]:
        """Height and width of the pictures in pixels."""
        return self._footage.size_hw

    def forward(self) -> Iterator[Frame]:
        """All frames, in order."""
        return self._watch.timed("decode", self._footage.forward())

    def backward(self, start: int, stop: int) -> Iterator[Frame]:
        """The frames ``stop - 1``, ``stop - 2``, … down to `start`."""
        with self._watch.stage("rewind"):
            frames = self._footage.backward(start, stop)
        return self._watch.timed("rewind", frames)


class FrameProgress:
    """Counts the frames of all walks through a video, and tells after each."""

    def __init__(self, tell: OnProgress | None) -> None:
        self._tell = tell or (lambda _done, _total: None)
        self._done = 0
        self._total: int | None = None
        self._told: int | None = None

    def expect(self, more: int | None) -> None:
        """Say how many frames are still to come; None when nobody knows."""
        self._total = None if more is None else self._done + more

    def step(self) -> None:
        """Count a frame."""
        self._done += 1
        self._told = None if self._total is None else max(self._total, self._done)
        self._tell(self._done, self._told)

    def finish(self) -> None:
        """Tell that all is done, unless that was told with the last frame."""
        if self._told != self._done:
            self._tell(self._done, self._done)


def frames_to_walk(
    tracks: Sequence[Track],
    options: PropagationOptions,
    frame_count: int,
    passes: PassCache,
    *,
    surveyed: bool,
) -> int:
    """How many frames propagation still reads, forward and backward, as far as can be foreseen.

    Parameters
    ----------
    tracks : sequence of Track
        What a person drew.
    options : PropagationOptions
        As of `propagate`.
    frame_count : int
        Frames of the video, or what its header promises.
    passes : PassCache
        Passes that need not be made.
    surveyed : bool
        Whether the walk through the whole video is done.
    """
    forward = 0 if surveyed else frame_count
    backward = []
    for key in _missing_passes(tracks, options, frame_count, passes):
        last = frame_count - 1 if key.last is None else min(key.last, frame_count - 1)
        if last < key.frame:
            backward.append((last, key.frame + 1))
        else:
            forward = max(forward, last + 1)
    return forward + _covered(backward)


def _covered(stretches: Iterable[tuple[int, int]]) -> int:
    """Frames in at least one of the stretches (start, stop)."""
    count = reached = 0
    for start, stop in sorted(stretches):
        count += max(0, stop - max(start, reached))
        reached = max(stop, reached)
    return count


def _missing_passes(
    tracks: Sequence[Track], options: PropagationOptions, frame_count: int, passes: PassCache
) -> Iterator[PassKey]:
    for track in tracks:
        if (track.method or options.method) is not Method.SITUP:
            continue
        keyframes = [keyframe for keyframe in track.keyframes if keyframe.frame < frame_count]
        extend = (track.extend or options.extend) is Extend.BOTH
        keys = forward_passes(keyframes) + [
            key
            for key in backward_passes(keyframes, extend=extend)
            if key.open or options.direction == "both"
        ]
        yield from (key for key in keys if key not in passes)
