"""Overlays: frame N shows frame N's boxes at frame N's time, whatever else they show."""

import dataclasses

import av
import numpy as np
import pytest
from support.counting import COUNT, SIZE_HW, VFR, box_index, labelled, write_counting
from support.media import read_index

from situp_annotate.errors import SitupError, VideoError
from situp_annotate.finished.redrawing import redraw, redraw_beside
from situp_annotate.formats.overlay.options import OverlayOptions

ONLY_COUNTER = OverlayOptions(captions="none", tracks=(1,))


def decode(path):
    """Pictures and times in nanoseconds."""
    with av.open(str(path)) as container:
        frames = list(container.decode(video=0))
    return [(f.to_ndarray(format="bgr24"), round(f.pts * f.time_base * 10**9)) for f in frames]


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    return labelled(write_counting(tmp_path_factory.mktemp("clips") / "clip.mp4"))


KINDS = {
    "constant": {},
    "b-frames": {"b_frames": 3},
    "variable": VFR,
    "variable with b-frames": {**VFR, "b_frames": 2},
    "turned": {"rotation_degrees": 90},
    "upside down": {"rotation_degrees": 180, **VFR},
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_frame_shows_its_own_boxes_at_its_own_time(tmp_path, kind):
    video = labelled(write_counting(tmp_path / "clip.mp4", **KINDS[kind]))
    redraw(video, tmp_path / "overlay.mp4", ONLY_COUNTER, threads=2)
    shown = decode(tmp_path / "overlay.mp4")
    assert [read_index(image) for image, _ in shown] == list(range(COUNT))
    assert [box_index(image) for image, _ in shown] == list(range(COUNT))
    assert [time for _, time in shown] == pytest.approx([*video.times_ns.values()], abs=20_000)
    assert shown[0][0].shape[:2] == SIZE_HW


def test_threads_change_no_byte(video, tmp_path):
    options = OverlayOptions(trails=0.5)
    for threads in (1, 2):
        redraw(video, tmp_path / f"{threads}.mp4", options, threads=threads)
    assert (tmp_path / "1.mp4").read_bytes() == (tmp_path / "2.mp4").read_bytes()


@pytest.mark.parametrize("kind", ["constant", "variable"])
def test_doubtful_stretches_alone(tmp_path, kind):
    path = write_counting(tmp_path / "clip.mp4", **KINDS[kind])
    video = labelled(path, confidence={7: 0.3, 8: 0.4, 30: 0.2})
    options = dataclasses.replace(ONLY_COUNTER, below=0.5, context=1e-9)
    redraw(video, tmp_path / "overlay.mp4", options)
    shown = decode(tmp_path / "overlay.mp4")
    assert [read_index(image) for image, _ in shown] == [7, 8, 30]
    assert [box_index(image) for image, _ in shown] == [7, 8, 30]
    times = [time for _, time in shown]
    assert times[0] == 0
    assert times[1] == pytest.approx(video.times_ns[8] - video.times_ns[7], abs=20_000)
    assert times[2] - times[1] == pytest.approx(1e9 / float(video.info.frame_rate), rel=0.01)


def test_nothing_doubtful_says_so(video, tmp_path):
    redraw(video, tmp_path / "sure.mp4", dataclasses.replace(ONLY_COUNTER, below=0.5))
    ((image, _),) = decode(tmp_path / "sure.mp4")
    corner = image[:20, :300].astype(int)
    assert corner.min() < 40
    assert (corner.min(axis=2) > 200).any()  # white letters, which the clip has nowhere


@pytest.mark.parametrize("limit", [240, 480, 1000])
def test_smaller_pictures_have_their_boxes_in_place(video, tmp_path, limit):
    options = dataclasses.replace(ONLY_COUNTER, max_height=limit)
    redraw(video, tmp_path / "small.mp4", options)
    shown = [image for image, _ in decode(tmp_path / "small.mp4")]
    assert {image.shape[0] for image in shown} == {min(limit, 480)}
    assert [box_index(image) for image in shown] == list(range(COUNT))
    assert [read_index(image) for image in shown] == list(range(COUNT))


def test_only_chosen_tracks_are_drawn(video, tmp_path):
    redraw(video, tmp_path / "both.mp4", OverlayOptions(captions="none"))
    redraw(video, tmp_path / "one.mp4", ONLY_COUNTER)
    ghost = np.s_[395:455, 295:365]
    both, one = (decode(tmp_path / f"{name}.mp4")[5][0].astype(int) for name in ("both", "one"))
    changed = np.abs(both - one).max(axis=2) > 60
    assert changed[ghost].any()
    changed[ghost] = False
    assert not changed.any()


def test_trails_lead_to_the_box(video, tmp_path):
    options = dataclasses.replace(ONLY_COUNTER, trails=0.5)
    redraw(video, tmp_path / "trail.mp4", options)
    redraw(video, tmp_path / "bare.mp4", ONLY_COUNTER)
    trail, bare = (
        decode(tmp_path / f"{name}.mp4")[30][0].astype(int) for name in ("trail", "bare")
    )
    changed = np.flatnonzero(np.abs(trail - bare)[16:20].max(axis=(0, 2)) > 30)
    center = 8 + 14 * 30 + 12
    assert changed.max() == pytest.approx(center, abs=6)
    assert center - 15 * 14 - 6 <= changed.min() < center - 10 * 14


def test_sound_is_taken_along_unless_told_otherwise(tmp_path):
    path = write_counting(tmp_path / "clip.mp4", audio_seconds=1.0)
    video = labelled(path, confidence={3: 0.1})
    kinds = {}
    for name, values in {"whole": {}, "silent": {"sound": False}, "part": {"below": 0.5}}.items():
        redraw(video, tmp_path / f"{name}.mp4", dataclasses.replace(ONLY_COUNTER, **values))
        with av.open(str(tmp_path / f"{name}.mp4")) as container:
            kinds[name] = len(container.streams.audio)
    assert kinds == {"whole": 1, "silent": 0, "part": 0}


def test_two_runs_beside_each_other(video, tmp_path):
    moved = {
        index: dataclasses.replace(point, box=dataclasses.replace(point.box, x=8))
        for index, point in video.tracks[0].points.items()
    }
    track = dataclasses.replace(video.tracks[0], points=moved)
    other = dataclasses.replace(video, tracks=(track, video.tracks[1]))
    redraw_beside(("before", video), ("after", other), tmp_path / "both.mp4", ONLY_COUNTER)
    for index, (image, _) in enumerate(decode(tmp_path / "both.mp4")):
        left, right = image[:, :640], image[:, 644:]
        assert image.shape == (480, 1284, 3)
        assert (read_index(left), read_index(right)) == (index, index)
        # The titles stand to the left of what is looked at.
        assert box_index(right) == 0
        assert index < 8 or box_index(left) == index


def test_runs_of_different_videos_are_not_compared(video, tmp_path):
    other = dataclasses.replace(video, frame_count=7)
    with pytest.raises(SitupError, match=r"one has 40 frames of 640 × 480 .* the other 7 frames"):
        redraw_beside(("a", video), ("b", other), tmp_path / "both.mp4", ONLY_COUNTER)


def test_every_frame_is_told_of(video, tmp_path):
    told = []
    redraw(video, tmp_path / "overlay.mp4", ONLY_COUNTER, on_frame=lambda: told.append(1))
    assert len(told) == COUNT


def test_another_video_is_noticed(video, tmp_path):
    shorter = dataclasses.replace(video, frame_count=COUNT + 1)
    with pytest.raises(VideoError, match="not the video that was annotated: it has 40 frames"):
        redraw(shorter, tmp_path / "overlay.mp4", ONLY_COUNTER, threads=2)
    late = dataclasses.replace(video, times_ns={**video.times_ns, 9: 5 * 10**9})
    with pytest.raises(VideoError, match=r"frame 9 is at 0\.300 s, not at 5\.000 s"):
        redraw(late, tmp_path / "overlay.mp4", ONLY_COUNTER)
