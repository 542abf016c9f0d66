"""The labels of a video: a box, state, provenance and confidence for each track and frame."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from situp_annotate.propagation.confidence import Evidence
from situp_annotate.types import BoundingBox, Provenance, State, Track, TrackPoint

__all__ = ["Labels", "Skip", "Stretch", "TrackLabels"]

Array = npt.NDArray[np.float64]


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


@dataclass(frozen=True, slots=True)
class Stretch:
    """Labels of a span of frames.

    Attributes
    ----------
    start : int
        Frame of the first row.
    boxes : ndarray
        (n, 4): x, y, width, height in pixels.
    states : tuple of State
        Of each frame.
    provenances : tuple of Provenance
        Of each frame.
    confidence : ndarray
        (n,), in [0, 1]; 1 for human boxes.
    evidence : Evidence
        What is known of each box.
    apce, peak, scale : ndarray
        (n,); NaN for boxes that no tracker found.
    """

    start: int
    boxes: Array
    states: tuple[State, ...]
    provenances: tuple[Provenance, ...]
    confidence: Array
    evidence: Evidence
    apce: Array
    peak: Array
    scale: Array

    @property
    def stop(self) -> int:
        """The frame after the last row."""
        return self.start + len(self.boxes)

    def point(self, track_id: int, frame: int) -> TrackPoint:
        """The label of a frame of the span."""
        row = frame - self.start
        x, y, width, height = (float(number) for number in self.boxes[row])
        tracked = self.provenances[row] is Provenance.TRACKED
        return TrackPoint(
            track_id,
            BoundingBox(x, y, width, height),
            float(self.confidence[row]),
            self.states[row],
            self.provenances[row],
            apce=float(self.apce[row]) if tracked else None,
            peak=float(self.peak[row]) if tracked else None,
            scale=float(self.scale[row]) if tracked else None,
        )


@dataclass(frozen=True, slots=True)
class TrackLabels:
    """Labels of one track.

    Attributes
    ----------
    track : Track
        What the person drew.
    stretches : tuple of Stretch
        In order of time; neighbours may share a keyframe. Frames in none have no box.
    """

    track: Track
    stretches: tuple[Stretch, ...]

    def points(self) -> Iterator[tuple[int, TrackPoint]]:
        """Frames with a box and their labels, in order."""
        done = -1
        for stretch in self.stretches:
            for frame in range(max(stretch.start, done + 1), stretch.stop):
                yield frame, stretch.point(self.track.id, frame)
            done = max(done, stretch.stop - 1)


@dataclass(frozen=True, slots=True)
class Labels:
    """What propagation makes of the tracks of one video.

    Attributes
    ----------
    frame_count : int
        Frames of the video.
    tracks : tuple of TrackLabels
        By track id.
    skipped : tuple of Skip
        Keyframes that could not be used.
    """

    frame_count: int
    tracks: tuple[TrackLabels, ...]
    skipped: tuple[Skip, ...]

    def __iter__(self) -> Iterator[tuple[TrackPoint, ...]]:
        """Labels of each frame in turn, sorted by track id."""
        walks = [labels.points() for labels in self.tracks]
        heads = [next(walk, None) for walk in walks]
        for frame in range(self.frame_count):
            points = []
            for number, head in enumerate(heads):
                if head is not None and head[0] == frame:
                    points.append(head[1])
                    heads[number] = next(walks[number], None)
            yield tuple(points)
