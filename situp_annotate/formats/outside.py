"""Where a person said that an object has left the picture, and where nobody knows."""

from collections.abc import Collection, Sequence

from situp_annotate.formats.labelled import LabelledTrack
from situp_annotate.types import Frame, State, Track, TrackPoint

__all__ = ["OUTSIDE", "OutsideTracks", "unsettled_frames"]

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


def unsettled_frames(
    labelled: LabelledTrack, *, frame_count: int, states: Collection[State]
) -> set[int]:
    """Frames without a label of an object that may well be in the picture.

    These are frames whose label is left out, and frames of which nobody has said anything, such
    as those before the first label. In all others the object has a label, or a person said that
    it is outside.

    Parameters
    ----------
    labelled : LabelledTrack
        The track.
    frame_count : int
        Frames of the video.
    states : collection of State
        Labels in other states are left out.
    """
    leaving = {keyframe.frame for keyframe in labelled.track.keyframes if keyframe.box is None}
    wanted = labelled.in_states(states)
    unsettled, outside = set(), False
    for frame in range(frame_count):
        outside = (outside or frame in leaving) and frame not in labelled.points
        if not outside and frame not in wanted:
            unsettled.add(frame)
    return unsettled
