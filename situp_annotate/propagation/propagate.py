"""The narrow waist of the house: pictures and keyframes in, labels out."""

from collections.abc import Callable, Sequence
from functools import partial

from situp_annotate.propagation.footage import Footage
from situp_annotate.propagation.interpolation import interpolate
from situp_annotate.propagation.labelling import (
    label_bridged,
    label_closed,
    label_interpolated,
    label_open,
)
from situp_annotate.propagation.labels import Labels, Skip, Stretch, TrackLabels
from situp_annotate.propagation.options import PropagationOptions
from situp_annotate.propagation.passes import TrackerFactory
from situp_annotate.propagation.spans import (
    PassKey,
    Span,
    backward_passes,
    forward_passes,
    runs,
    spans,
)
from situp_annotate.propagation.walking import PassCache, Survey, Walker
from situp_annotate.trackers import default_tracker
from situp_annotate.types import BoundingBox, Extend, Keyframe, Method, Track

__all__ = ["propagate"]

_MOST_OF_PICTURE = 2
"""Width or height of a box that is tracked, over the picture's: memory grows with both."""

_LEAST_SIZE = 0.001
"""Pixels, of a width or height; what is made of a box divides by its area."""


def propagate(
    footage: Footage,
    tracks: Sequence[Track],
    options: PropagationOptions | None = None,
    *,
    tracker: TrackerFactory = default_tracker,
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
    depend on these two alone. Where the person says that the object is hidden until the next box,
    it is not tracked but bridged. From an ``outside`` keyframe to the next keyframe with a box, and
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
        Makes a fresh tracker: that of the preset which ``run`` takes; ``SitupTracker``, say, the
        paper's.
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
    with Walker(threads, tracker, passes, on_frame) as walker:
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


def _fault(box: BoundingBox, height: int, width: int, *, tracked: bool) -> str | None:
    """Why nothing can start from a box; None if it can."""
    picture = f"the picture of {width}×{height} pixels"
    if not box.intersects(width, height):
        return f"lies outside {picture}"
    if tracked and max(box.width / width, box.height / height) > _MOST_OF_PICTURE:
        return f"is more than {_MOST_OF_PICTURE} times as wide or high as {picture}"
    if min(box.width, box.height) < _LEAST_SIZE:
        return f"is less than {_LEAST_SIZE} pixels wide or high"
    return None


class _Plan:
    """What is to be done for one track."""

    def __init__(self, track: Track, options: PropagationOptions, size_hw: tuple[int, int]) -> None:
        self.skipped: list[Skip] = []
        self._track = track
        self._method = track.method or options.method
        self._both = options.direction == "both"
        self._extend = (track.extend or options.extend) is Extend.BOTH
        self._keyframes = [k for k in track.keyframes if self._is_usable(k, size_hw)]

    @property
    def _tracked(self) -> bool:
        return self._method is Method.SITUP

    def _is_usable(self, keyframe: Keyframe, size_hw: tuple[int, int]) -> bool:
        height, width = size_hw
        fault = keyframe.box and _fault(keyframe.box, height, width, tracked=self._tracked)
        if fault:
            self._skip(keyframe, f"the box of the keyframe at frame {keyframe.frame} {fault}")
        return not fault

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
        shifts = survey.shifts[span.start : span.stop]
        if span.is_hidden:
            return label_bridged(span, shifts)
        if span.before is None:
            return label_open(span, passes[backward[span.stop - 1]].reversed())
        ahead = passes[forward[span.start]]
        if span.after is None:
            return label_open(span, ahead.head(count))
        behind = passes[backward[span.stop - 1]].reversed() if self._both else None
        return label_closed(span, ahead, behind, shifts)

    def _drawn_span(self, span: Span) -> Stretch:
        ends = [keyframe for keyframe in (span.before, span.after) if keyframe is not None]
        run = next(run for run in runs(self._keyframes) if ends[0] in run)
        return label_interpolated(span, interpolate(run, self._method, span.start, span.stop))
