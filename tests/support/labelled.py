"""Labelled videos made up: what a run would have found."""

from fractions import Fraction
from pathlib import Path

from hypothesis import strategies as st

from situp_annotate.formats.labelled import LabelledTrack, LabelledVideo
from situp_annotate.formats.seeds import ImportHints
from situp_annotate.types import (
    BoundingBox,
    Keyframe,
    Provenance,
    State,
    Track,
    TrackPoint,
    VideoInfo,
)

SIZE = (640, 480)


def import_hints(*, label="object", frame_count=None, **more):
    """Hints of a video with so many frames; with none, nothing may ask for its times."""

    def times_ns(name):
        assert frame_count is not None, f"the frames of {name!r} are not to be asked for"
        return range(0, frame_count * 40_000_000, 40_000_000)

    return ImportHints(label, times_ns, lambda _: SIZE, **more)


def labelled_track(track_id, points, label="car", attributes=None):
    """Points by frame: a box, or a box and what else differs from a visible, tracked one.

    Wherever there are points, and wherever they end, a person has said so.
    """
    made = {}
    for frame, given in sorted(points.items()):
        box, state, provenance = (given, State.VISIBLE, Provenance.TRACKED)
        if isinstance(given, tuple):
            box, state, provenance = given
        made[frame] = TrackPoint(track_id, box, 0.5, state, provenance)
    begun = [Keyframe(frame, made[frame].box) for frame in made if frame - 1 not in made]
    ended = [Keyframe(frame + 1, None) for frame in made if frame + 1 not in made]
    keyframes = sorted([*begun, *ended], key=lambda keyframe: keyframe.frame)
    nowhere = [Keyframe(0, BoundingBox(0, 0, 1, 1)), Keyframe(1, None)]
    track = Track(track_id, label, tuple(keyframes or nowhere), attributes or {})
    return LabelledTrack(track, made)


def labelled_video(*tracks, video_id="clip", frame_count=20, rate=Fraction(30000, 1001)):
    width, height = SIZE
    info = VideoInfo(Path("/videos") / f"{video_id}.mp4", "opencv", width, height, rate)
    times = {frame: frame * 40_000_000 for track in tracks for frame in track.points}
    return LabelledVideo(video_id, info, frame_count, times, tracks)


def labelled_videos(*, frame_count=12, least_size=0.001, labels=("car", "dog & <cat>")):
    """Videos of every kind: boxes out of the picture, gaps, states, boxes that a person drew."""
    place, size = st.floats(-700, 1400), st.floats(least_size, 700)
    box = st.builds(BoundingBox, place, place, size, size)
    point = st.tuples(box, st.sampled_from(State), st.sampled_from(Provenance))
    points = st.dictionaries(st.integers(0, frame_count - 1), point, max_size=frame_count)
    tracks = st.dictionaries(
        st.integers(1, 999), st.tuples(points, st.sampled_from(labels)), max_size=4
    )

    def build(given):
        made = [labelled_track(id_, points, label) for id_, (points, label) in given.items()]
        made.sort(key=lambda track: track.track.id)
        return labelled_video(*made, frame_count=frame_count)

    return tracks.map(build)
