"""The narrow waist of the house: pictures and keyframes in, labels out."""

from collections.abc import Callable, Iterable, Iterator, MutableMapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from situp_annotate.propagation.camera import CameraMotion
from situp_annotate.propagation.footage import Footage
from situp_annotate.propagation.interpolation import interpolate
from situp_annotate.propagation.labelling import label_closed, label_interpolated, label_open
from situp_annotate.propagation.labels import Labels, Skip, Stretch, TrackLabels
from situp_annotate.propagation.options import PropagationOptions
from situp_annotate.propagation.passes import Follower, Pass, TrackerFactory
from situp_annotate.propagation.spans import (
    PassKey,
    Span,
    backward_passes,
    forward_passes,
    runs,
    spans,
)
from situp_annotate.tracking import SitupTracker
from situp_annotate.types import Extend, Frame, Keyframe, Method, Track

__all__ = ["PassCache", "Survey", "propagate"]

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


def propagate(
    footage: Footage,
    tracks: Sequence[Track],
    options: PropagationOptions | None = None,
    *,
    tracker: TrackerFactory = SitupTracker,
    threads: int = 1,
    cache: PassCache | None = None,
    survey: Survey | None = None,
    on_frame: Callable[[], None] | None = None,
    on_survey: Callable[[Survey], None] | None = None,
) -> Labels:
    """Propagate hand-drawn boxes through a video.

    Between two keyframes of a track the object is tracked forward from the earlier and backward
    from the later, and both passes are fused; after the last it is tracked forward. A keyframe's
    own frame has the box that the person drew, to the digit. The labels between two keyframes
    depend on these two alone. From an ``outside`` keyframe to the next keyframe with a box, and
    before the first, the track has no boxes (unless it is extended).

    Parameters
    ----------
    footage : Footage
        Read forward once, then backward where there are keyframes to come back from. Memory does
        not grow with its length.
    tracks : sequence of Track
        What a person drew; ids unique.
    options : PropagationOptions, optional
        How to go about it.
    tracker : callable, optional
        Makes a fresh tracker; ``functools.partial(SitupTracker, TrackerParams(...))``, say.
    threads : int
        Tracks to follow at a time; at least 1. The labels do not depend on it.
    cache : mapping, optional
        Passes that are in it are not made again; those that are made are put into it.
    survey : Survey, optional
        Of the same footage, as `on_survey` was told; with it and all passes in the cache nothing
        is read.
    on_frame : callable, optional
        Called after each frame that was read.
    on_survey : callable, optional
        Called with the survey once the footage has been read forward, before it is read backward.

    Returns
    -------
    Labels
        Iterate it for the labels of each frame.
    """
    options = options or PropagationOptions()
    passes: PassCache = {} if cache is None else cache
    plans = [_Plan(track, options, footage.size_hw) for track in _by_id(tracks)]
    with _Walker(threads, tracker, passes, on_frame) as walker:
        if survey is None:
            survey = walker.survey(footage, [plan.forward_passes() for plan in plans])
        if on_survey is not None:
            on_survey(survey)
        for plan in plans:
            plan.cut(survey.frame_count)
        # After a survey only where a keyframe turned out to be the last one.
        walker.forward(footage, [plan.forward_passes() for plan in plans], survey)
        walker.backward(footage, [plan.backward_passes() for plan in plans], survey)
    labelled = tuple(plan.label(passes, survey) for plan in plans)
    return Labels(survey.frame_count, labelled, tuple(s for plan in plans for s in plan.skipped))


def _by_id(tracks: Sequence[Track]) -> list[Track]:
    return sorted(tracks, key=lambda track: track.id)


class _Plan:
    """What is to be done for one track."""

    def __init__(self, track: Track, options: PropagationOptions, size_hw: tuple[int, int]) -> None:
        self.skipped: list[Skip] = []
        self._track = track
        self._method = track.method or options.method
        self._both = options.direction == "both"
        self._extend = (track.extend or options.extend) is Extend.BOTH
        self._keyframes = [k for k in track.keyframes if self._is_in_picture(k, size_hw)]

    @property
    def _tracked(self) -> bool:
        return self._method is Method.SITUP

    def _is_in_picture(self, keyframe: Keyframe, size_hw: tuple[int, int]) -> bool:
        height, width = size_hw
        if keyframe.box is None or keyframe.box.intersects(width, height):
            return True
        self._skip(
            keyframe,
            f"the box of the keyframe at frame {keyframe.frame} lies outside the picture of "
            f"{width}×{height} pixels",
        )
        return False

    def cut(self, frame_count: int) -> None:
        """Leave out keyframes past the end of the video."""
        for keyframe in self._keyframes:
            if keyframe.frame >= frame_count:
                self._skip(
                    keyframe,
                    f"the keyframe at frame {keyframe.frame} is past the end; the video's last "
                    f"frame is {frame_count - 1}",
                )
        self._keyframes = [k for k in self._keyframes if k.frame < frame_count]
        self.skipped.sort(key=lambda skip: skip.frame)

    def _skip(self, keyframe: Keyframe, reason: str) -> None:
        track_id = self._track.id
        self.skipped.append(Skip(track_id, keyframe.frame, f"Track {track_id}: {reason}."))

    def forward_passes(self) -> list[PassKey]:
        return forward_passes(self._keyframes) if self._tracked else []

    def backward_passes(self) -> list[PassKey]:
        if not self._tracked:
            return []
        passes = backward_passes(self._keyframes, extend=self._extend)
        return passes if self._both else [key for key in passes if key.open]

    def label(self, passes: PassCache, survey: Survey) -> TrackLabels:
        """Make the labels from the passes."""
        found = spans(self._keyframes, survey.frame_count, extend=self._extend)
        label = partial(self._tracked_span, passes, survey) if self._tracked else self._drawn_span
        return TrackLabels(self._track, tuple(label(span) for span in found))

    def _tracked_span(self, passes: PassCache, survey: Survey, span: Span) -> Stretch:
        forward = {key.frame: key for key in self.forward_passes()}
        backward = {key.frame: key for key in self.backward_passes()}
        count = span.stop - span.start
        if span.before is None:
            return label_open(span, passes[backward[span.stop - 1]].reversed())
        ahead = passes[forward[span.start]]
        if span.after is None:
            return label_open(span, ahead.head(count))
        behind = passes[backward[span.stop - 1]].reversed() if self._both else None
        return label_closed(span, ahead, behind, survey.shifts[span.start : span.stop])

    def _drawn_span(self, span: Span) -> Stretch:
        ends = [keyframe for keyframe in (span.before, span.after) if keyframe is not None]
        run = next(run for run in runs(self._keyframes) if ends[0] in run)
        return label_interpolated(span, interpolate(run, self._method, span.start, span.stop))


class _Walker:
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

    def __enter__(self) -> "_Walker":
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
