"""Pages of the review report, made from labels that no tracker has to be run for."""

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np

from situp_annotate.propagation import (
    FramesInMemory,
    Labels,
    PropagationOptions,
    Stretch,
    propagate,
    suggest,
)
from situp_annotate.report import ReportSink
from situp_annotate.types import (
    BoundingBox,
    Finding,
    Frame,
    Keyframe,
    Method,
    State,
    Track,
    VideoInfo,
)
from situp_annotate.video import ForwardWalk

__all__ = ["SIZE_HW", "linear_labels", "linear_track", "with_states", "write_page"]

SIZE_HW = (60, 80)
FRAME_NS = 40_000_000


def linear_track(
    track_id: int,
    frames: Sequence[int],
    *,
    label: str = "thing",
    occluded: Sequence[int] = (),
    **more: object,
) -> Track:
    """A track whose box goes to the right between keyframes, hidden after some of them."""
    keyframes = tuple(
        Keyframe(n, BoundingBox(4 + n % 40, 10, 16, 12), occluded=n in occluded) for n in frames
    )
    return Track(track_id, label, keyframes, **more)


def linear_labels(tracks: Sequence[Track], frame_count: int) -> Labels:
    """Labels of tracks, interpolated."""
    blank = np.zeros((*SIZE_HW, 3), np.uint8)
    frames = [Frame(n, n * FRAME_NS, blank) for n in range(frame_count)]
    return propagate(FramesInMemory(frames), tracks, PropagationOptions(method=Method.LINEAR))


def with_states(stretch: Stretch, states: Sequence[State]) -> Stretch:
    """The stretch in other states."""
    return replace(stretch, states=tuple(states))


def write_page(
    path: Path,
    labels: Labels,
    *,
    times_ns: Sequence[int] | None = None,
    files: Sequence[str] = (),
    findings: Sequence[Finding] = (),
    video_id: str = "clip",
) -> str:
    """Write the page of a video and return its text."""
    times = tuple(times_ns or (n * FRAME_NS for n in range(labels.frame_count)))
    info = VideoInfo(Path("clips/clip.mp4"), "opencv", SIZE_HW[1], SIZE_HW[0], Fraction(25))
    walk = ForwardWalk(info, times, tuple(findings))
    suggestions = [each for track in labels.tracks for each in suggest(track, SIZE_HW)]
    ramp = np.broadcast_to(np.arange(SIZE_HW[1], dtype=np.uint8)[:, None] * 3, (*SIZE_HW, 3))
    with ReportSink(
        path, video_id=video_id, walk=walk, labels=labels, suggestions=suggestions, files=files
    ) as sink:
        for n, points in enumerate(labels):
            sink.write(Frame(n, times[n], ramp), points)
    return path.read_text(encoding="utf-8")
