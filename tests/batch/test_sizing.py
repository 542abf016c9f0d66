"""How much work and memory a video is expected to need."""

from fractions import Fraction

import psutil
import pytest

from situp_annotate.batch import sizing
from situp_annotate.batch.tally import Tally
from situp_annotate.formats.manifest import load_manifest
from situp_annotate.progress import BatchProgress, RunningVideo
from situp_annotate.recipe import Recipe, load_recipe
from situp_annotate.types import BoundingBox, Keyframe, Track, VideoJob

TRACK = Track(1, "thing", (Keyframe(0, BoundingBox(0, 0, 9, 9)),))


def test_work_grows_with_frames_and_tracks(tmp_path):
    small, large = tmp_path / "small.mp4", tmp_path / "large.mp4"
    small.write_bytes(b"x" * 1000)
    large.write_bytes(b"x" * 100_000)
    (tmp_path / "seq" / "img").mkdir(parents=True)
    for number in range(7):
        (tmp_path / "seq" / "img" / f"{number}.jpg").touch()

    def work(path, *tracks, **hints):
        return sizing.expected_work(VideoJob("v", path, tracks, **hints))

    assert 0 < work(small) < work(large) < work(large, TRACK)
    assert work(small, frame_count_hint=300) == 300
    assert work(tmp_path / "seq") == 7
    assert work(tmp_path / "none.mp4") == 0


def test_hints_come_from_the_manifest(tmp_path):
    (tmp_path / "manifest.json").write_text(
        '{"version": 1, "videos": [{"path": "a.mp4", "tracks": [],'
        ' "info": {"width": 1920, "height": 1080, "frames": 99}}, {"path": "b.mp4", "tracks": []}]}'
    )
    known, unknown = load_manifest(tmp_path / "manifest.json").jobs
    assert (known.frame_count_hint, known.size_hint_hw) == (99, (1080, 1920))
    assert (unknown.frame_count_hint, unknown.size_hint_hw) == (None, None)


@pytest.mark.parametrize("share", [Fraction(1, 10), Fraction(1, 4), 10])
def test_workers_fit_into_memory_and_there_is_always_one(monkeypatch, share):
    monkeypatch.setattr(sizing, "_available_bytes", lambda: int(share * 2**30))
    small = VideoJob("s", None, (), size_hint_hw=(240, 320))
    large = VideoJob("l", None, (), size_hint_hw=(4320, 7680))
    counts = [sizing.workers_for_memory(jobs, Recipe()) for jobs in ([small], [small, large])]
    assert counts[0] >= counts[1] >= 1
    assert (counts[0] > 1) == (share > 1)
    hungry = load_recipe("situp", ["propagation.memory_mb=4000"])
    assert sizing.workers_for_memory([small], hungry) <= counts[0]


def test_memory_is_what_the_container_allows(monkeypatch, tmp_path):
    (tmp_path / "max").write_text("1000\n")
    (tmp_path / "current").write_text("400\n")
    limits = ((str(tmp_path / "max"), str(tmp_path / "current")), ("/none", "/none"))
    monkeypatch.setattr(sizing, "_CGROUP_LIMITS", limits)
    assert sizing._available_bytes() == 600
    (tmp_path / "max").write_text("max\n")
    free = psutil.virtual_memory().available
    assert abs(sizing._available_bytes() - free) < 0.5 * free


def test_an_empty_batch_and_one_that_nobody_knows_of():
    assert Tally(0).progress([]) == BatchProgress(0, 0, 0, 0, 0)
    assert Tally(3).progress([]) == BatchProgress(0, 3, 0, 0, 0)


def test_videos_that_nothing_is_known_of_count_as_the_mean_of_the_others():
    tally = Tally(5)
    tally.skip()
    tally.end(frames=100, failed=False)
    running = (RunningVideo("a", 50, 200, 1.0), RunningVideo("b", 0, 0, 0.1))
    assert tally.progress(running) == BatchProgress(2, 5, 0, 150, 600, running)
    tally.end(frames=0, failed=True)
    assert tally.progress(()).failed == 1
