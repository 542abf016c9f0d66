"""Which tracks a person said to have left the picture, frame by frame."""

from collections.abc import Sequence

from situp_annotate.types import Frame, Track, TrackPoint

__all__ = ["OUTSIDE", "OutsideTracks"]

OUTSIDE = "outside"
"""State of an object that has left the picture: no box is in this state."""


class OutsideTracks:
    """Follows which tracks are outside, from their ``outside`` keyframe to their next box.

    Parameters
    ----------
    tracks : sequence of Track
        Every track of the video.
    """

    def __init__(self, tracks: Sequence[Track]) -> None:
        self._tracks = {track.id: track for track in tracks}
        self._leaving = {(t.id, k.frame) for t in tracks for k in t.keyframes if k.box is None}
        self._outside: set[int] = set()

    def at(self, frame: Frame, points: Sequence[TrackPoint]) -> list[Track]:
        """Tracks that are outside in this frame, by id; frames must come in order."""
        self._outside |= {id_ for id_ in self._tracks if (id_, frame.index) in self._leaving}
        self._outside -= {point.track_id for point in points}
        return [self._tracks[track_id] for track_id in sorted(self._outside)]
