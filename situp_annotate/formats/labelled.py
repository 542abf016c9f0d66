"""What a run has found in a video: the value that every export is made from."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

from situp_annotate.types import State, Track, TrackPoint, VideoInfo

__all__ = ["LabelledTrack", "LabelledVideo"]


@dataclass(frozen=True, slots=True)
class LabelledTrack:
    """One track and all its labels.

    Attributes
    ----------
    track : Track
        What the person drew.
    points : mapping of int to TrackPoint
        The label of each frame that has a box, lost ones too, in order of frames.
    """

    track: Track
    points: Mapping[int, TrackPoint]

    def in_states(self, states: Collection[State]) -> dict[int, TrackPoint]:
        """The labels in one of these states, in order of frames."""
        return {frame: point for frame, point in self.points.items() if point.state in states}


@dataclass(frozen=True, slots=True)
class LabelledVideo:
    """One video and its labels.

    Attributes
    ----------
    id : str
        Of the job; names the output folder.
    info : VideoInfo
        What is known of the video.
    frame_count : int
        Frames of the video, as decoded.
    times_ns : mapping of int to int
        Time of each frame that has a label.
    tracks : tuple of LabelledTrack
        By track id.
    """

    id: str
    info: VideoInfo
    frame_count: int
    times_ns: Mapping[int, int]
    tracks: tuple[LabelledTrack, ...]

    def in_states(
        self, states: Collection[State]
    ) -> Iterator[tuple[int, LabelledTrack, TrackPoint]]:
        """Frame, track and label of each label in one of these states, by frame, then track id."""
        labels = [
            (frame, track.track.id, track, point)
            for track in self.tracks
            for frame, point in track.in_states(states).items()
        ]
        labels.sort(key=lambda entry: entry[:2])
        for frame, _, track, point in labels:
            yield frame, track, point
