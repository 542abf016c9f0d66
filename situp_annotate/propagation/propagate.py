"""The narrow waist of the house: frames in, labels out."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial

from situp_annotate.propagation.confidence import RelativeSharpness
from situp_annotate.tracking import Estimate, SitupTracker, Tracker
from situp_annotate.types import Frame, Image, Keyframe, Provenance, State, Track, TrackPoint

__all__ = ["Propagation", "Skip", "TrackerFactory", "propagate"]

_AHEAD_BYTES = 32 * 2**20
_MOST_AHEAD = 64

TrackerFactory = Callable[[], Tracker]
"""Makes a fresh tracker for a target; such as ``SitupTracker`` itself."""


@dataclass(frozen=True, slots=True)
class Skip:
    """A keyframe that could not be used.

    Attributes
    ----------
    track_id, frame : int
        Which keyframe.
    reason : str
        A finished sentence.
    """

    track_id: int
    frame: int
    reason: str


class Propagation:
    """Labels of the frames of one video, made as the frames come.

    Iterating yields ``(frame, points)`` for each frame, points sorted by track id. Each track is
    tracked forward from each of its keyframes to the next; a keyframe's own frame gets the box
    that the person drew, to the digit. From an ``outside`` keyframe to the next keyframe with a
    box, and before the first, the track has no points. A frame is handed out before the next is
    asked for, so memory does not grow with the video.

    Parameters
    ----------
    frames : iterable of Frame
        In order, from the first frame of the video.
    tracks : sequence of Track
        What the person drew.
    tracker : TrackerFactory
        Called anew for each keyframe with a box.
    threads : int
        Tracks to follow at a time; at least 1. The labels do not depend on it.
    """

    def __init__(
        self,
        frames: Iterable[Frame],
        tracks: Sequence[Track],
        tracker: TrackerFactory = SitupTracker,
        threads: int = 1,
    ) -> None:
        self._frames = frames
        self._threads = min(threads, len(tracks))
        self._followers = [
            _Follower(track, tracker) for track in sorted(tracks, key=lambda track: track.id)
        ]
        self._skipped: list[Skip] = []

    @property
    def skipped(self) -> tuple[Skip, ...]:
        """Keyframes that could not be used; complete once all frames are through."""
        return tuple(self._skipped)

    def __iter__(self) -> Iterator[tuple[Frame, tuple[TrackPoint, ...]]]:
        count = 0
        pool = ThreadPoolExecutor(self._threads) if self._threads > 1 else None
        with pool or nullcontext():
            follow = pool.map if pool else map
            for frames in _batches(self._frames, _AHEAD_BYTES if pool else 0):
                tracks = list(follow(partial(_follow, frames), self._followers))
                for number, frame in enumerate(frames):
                    count = frame.index + 1
                    points = [points[number] for points in tracks]
                    yield frame, tuple(point for point in points if point is not None)
        self._skipped = sorted(
            (skip for follower in self._followers for skip in follower.skipped(count)),
            key=lambda skip: (skip.track_id, skip.frame),
        )


def _batches(frames: Iterable[Frame], size: int) -> Iterator[list[Frame]]:
    """Gather frames up to a number of bytes, one at least; those before an error come first."""
    batch: list[Frame] = []
    try:
        for frame in frames:
            batch.append(frame)
            if (len(batch) + 1) * frame.image.nbytes > size or len(batch) == _MOST_AHEAD:
                yield batch
                batch = []
    except Exception:
        if batch:
            yield batch
        raise
    if batch:
        yield batch


def _follow(frames: Sequence[Frame], follower: "_Follower") -> list[TrackPoint | None]:
    return [follower.step(frame) for frame in frames]


class _Follower:
    """Follows one track through the frames of its video."""

    def __init__(self, track: Track, tracker: TrackerFactory) -> None:
        self._track = track
        self._keyframes = {keyframe.frame: keyframe for keyframe in track.keyframes}
        self._make_tracker = tracker
        self._tracker: Tracker | None = None
        self._confidence = RelativeSharpness()
        self._state = State.VISIBLE
        self._skipped: list[Skip] = []

    def step(self, frame: Frame) -> TrackPoint | None:
        """Label the next frame; None where the track has no box."""
        keyframe = self._keyframes.get(frame.index)
        if keyframe is not None and self._usable(keyframe, frame.image):
            return self._start(keyframe, frame)
        if self._tracker is None:
            return None
        return self._point(self._tracker.update(frame.image))

    def skipped(self, frame_count: int) -> list[Skip]:
        """Keyframes that were not used in a video of this many frames."""
        past = [
            Skip(
                self._track.id,
                keyframe.frame,
                f"Track {self._track.id}: the keyframe at frame {keyframe.frame} is past the end; "
                f"the video's last frame is {frame_count - 1}.",
            )
            for keyframe in self._track.keyframes
            if keyframe.frame >= frame_count
        ]
        return self._skipped + past

    def _usable(self, keyframe: Keyframe, image: Image) -> bool:
        height, width = image.shape[:2]
        if keyframe.box is None or keyframe.box.intersects(width, height):
            return True
        reason = (
            f"Track {self._track.id}: the box of the keyframe at frame {keyframe.frame} lies "
            f"outside the picture of {width}×{height} pixels."
        )
        self._skipped.append(Skip(self._track.id, keyframe.frame, reason))
        return False

    def _start(self, keyframe: Keyframe, frame: Frame) -> TrackPoint | None:
        if keyframe.box is None:
            self._tracker = None
            return None
        self._tracker = self._make_tracker()
        self._tracker.init(frame.image, keyframe.box)
        self._confidence = RelativeSharpness()
        self._state = State.OCCLUDED if keyframe.occluded else State.VISIBLE
        return TrackPoint(self._track.id, keyframe.box, 1.0, self._state, Provenance.HUMAN)

    def _point(self, estimate: Estimate) -> TrackPoint:
        return TrackPoint(
            self._track.id,
            estimate.box,
            self._confidence(estimate.apce),
            self._state,
            Provenance.TRACKED,
            apce=estimate.apce,
            peak=estimate.peak,
            scale=estimate.scale,
        )


def propagate(
    frames: Iterable[Frame],
    tracks: Sequence[Track],
    tracker: TrackerFactory = SitupTracker,
    threads: int = 1,
) -> Propagation:
    """Propagate hand-drawn boxes through a video.

    Parameters
    ----------
    frames : iterable of Frame
        In order, from the first frame; :func:`situp_annotate.open_video` gives such.
    tracks : sequence of Track
        What a person drew; ids unique.
    tracker : callable, optional
        Makes a fresh tracker; ``functools.partial(SitupTracker, TrackerParams(...))``, say.
    threads : int
        Tracks to follow at a time; at least 1. The labels do not depend on it.

    Returns
    -------
    Propagation
        Iterate it for ``(frame, points)``; afterwards ``skipped`` tells which keyframes could
        not be used.
    """
    return Propagation(frames, tracks, tracker, threads)
