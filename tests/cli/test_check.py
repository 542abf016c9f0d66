"""``situp-annotate check``: what it says of each video, and its exit codes."""

import json
from fractions import Fraction
from pathlib import Path

import pytest
from click.testing import CliRunner
from support.media import truncate, write_video

from situp_annotate.cli import cli
from situp_annotate.errors import VideoIncompleteError, VideoMissingError
from situp_annotate.types import Finding, VideoInfo


class FakeSource:
    """An open video of 100 × 50 pixels."""

    def __init__(self, path, frame_count=10, findings=(), error=None):
        self.info = VideoInfo(path, "opencv", 100, 50, Fraction(30000, 1001))
        self.frames_decoded = 0
        self.findings = []
        self._end = frame_count, findings, error

    def __enter__(self):
        return self

    def __exit__(self, *exc_info):
        pass

    def skip_through(self):
        self.frames_decoded, findings, error = self._end
        self.findings.extend(findings)
        if error:
            raise error
        return self.frames_decoded


@pytest.fixture
def videos(monkeypatch):
    """What each file name opens as; others are missing."""
    known = {}

    def open_video(path, **options):
        if path.name not in known:
            raise VideoMissingError(f"{path}: there is nothing here.")
        return FakeSource(path, **known[path.name])

    monkeypatch.setattr("situp_annotate.video.open_video", open_video)
    return known


def check(folder, *entries, options=()):
    path = folder / "manifest.json"
    path.write_text(json.dumps({"version": 1, "videos": list(entries)}))
    return CliRunner().invoke(cli, ["check", str(path), *options])


def video(path, *tracks):
    return {"path": path, "tracks": list(tracks)}


def track(frame, box, number=1):
    return {"id": number, "label": "car", "frame": frame, "box": box}


def test_all_fine(tmp_path, videos):
    videos["a.mp4"] = {}
    videos["b.mp4"] = {"frame_count": 1}
    outcome = check(tmp_path, video("a.mp4", track(9, [0, 0, 100, 50])), video("b.mp4"))
    assert outcome.stdout.splitlines() == [
        f"a: {tmp_path}/a.mp4, 100 × 50, 10 frames, 29.97 frames/s, 1 track: fine",
        f"b: {tmp_path}/b.mp4, 100 × 50, 1 frame, 29.97 frames/s, 0 tracks: fine",
        "2 videos: 2 fine, 0 with problems.",
    ]
    assert outcome.stderr == ""
    assert outcome.exit_code == 0


def test_everything_wrong_is_told_at_once(tmp_path, videos):
    videos["boxes.mp4"] = {}
    videos["cut.mp4"] = {"frame_count": 4, "error": VideoIncompleteError("cut.mp4: cut short.")}
    keyframes = [
        {"frame": 0, "box": [-3, 2, 10, 10]},
        {"frame": 3, "box": [100, 2, 10, 10.5]},
        {"frame": 8, "outside": True},
        {"frame": 10, "outside": True},
    ]
    outcome = check(
        tmp_path,
        video("boxes.mp4", {"id": 7, "label": "bus", "keyframes": keyframes}),
        video("gone.mp4", track(0, [1, 2, 3, 4])),
        video("cut.mp4", track(4, [1, 2, 3, 4])),
    )
    bus = 'track 7 ("bus"), frame'
    assert outcome.stdout.splitlines() == [
        f"boxes: {tmp_path}/boxes.mp4, 100 × 50, 10 frames, 29.97 frames/s, 1 track",
        f"  problem: {bus} 3: the box [100, 2, 10, 10.5] lies wholly outside the 100 × 50 picture.",
        f"  problem: {bus} 10: past the end; the video has 10 frames, 0 to 9.",
        f"  note: {bus} 0: the box [-3, 2, 10, 10] reaches beyond the 100 × 50 picture.",
        f"gone: {tmp_path}/gone.mp4, 1 track",
        f"  problem: {tmp_path}/gone.mp4: there is nothing here.",
        f"cut: {tmp_path}/cut.mp4, 100 × 50, 4 frames, 29.97 frames/s, 1 track",
        "  problem: cut.mp4: cut short.",
        '  problem: track 1 ("car"), frame 4: past the end; the video has 4 frames, 0 to 3.',
        "3 videos: 0 fine, 3 with problems.",
    ]
    assert outcome.exit_code == 1


@pytest.mark.parametrize(
    ("box", "word"),
    [
        ([0, 0, 100, 50], "fine"),
        ([99.5, 49.5, 1, 1], "note"),
        ([-1, 0, 1.5, 1], "note"),
        ([-1, 0, 1, 1], "problem"),
        ([100, 0, 1, 1], "problem"),
        ([0, 50, 1, 1], "problem"),
    ],
)
def test_at_the_border_of_the_picture(tmp_path, videos, box, word):
    videos["a.mp4"] = {}
    outcome = check(tmp_path, video("a.mp4", track(0, box)))
    assert [kind for kind in ("problem:", "note:") if kind in outcome.stdout] == (
        [] if word == "fine" else [f"{word}:"]
    )
    assert outcome.exit_code == (word == "problem")


def test_findings_are_notes(tmp_path, videos):
    videos["a.mp4"] = {"findings": [Finding("gap", "Half a second is missing.", 3)]}
    outcome = check(tmp_path, video("a.mp4"))
    assert "  note: Half a second is missing." in outcome.stdout.splitlines()
    assert outcome.exit_code == 0


def test_a_bad_manifest_opens_no_video(tmp_path, monkeypatch):
    monkeypatch.setattr("situp_annotate.video.open_video", None)
    outcome = check(tmp_path, video("/a.mp4"), video(""))
    assert outcome.exit_code == 3
    assert outcome.stdout == ""
    assert len(outcome.stderr.splitlines()) == 3  # "Error:" and two problems


def test_allow_outside(tmp_path, videos):
    videos["a.mp4"] = {}
    outside = video(str(Path("/elsewhere/a.mp4")))
    assert check(tmp_path, outside).exit_code == 3
    assert check(tmp_path, outside, options=["--allow-outside"]).exit_code == 0


def test_real_files(tmp_path):
    write_video(tmp_path / "good.mp4", count=12)
    truncate(tmp_path / "good.mp4", tmp_path / "cut.mp4", 0.5)
    (tmp_path / "text.mp4").write_text("no video")
    outcome = check(
        tmp_path,
        video("good.mp4", track(11, [0, 0, 9, 9]), track(12, [0, 0, 9, 9], 2)),
        *map(video, ("cut.mp4", "text.mp4", "gone.mp4")),
    )
    assert "good: " in outcome.stdout
    assert "64 × 48, 12 frames, 30 frames/s, 2 tracks" in outcome.stdout
    assert 'track 2 ("car"), frame 12: past the end; the video has 12 frames' in outcome.stdout
    assert outcome.stdout.count("  problem: ") == 4
    assert outcome.stdout.endswith("4 videos: 0 fine, 4 with problems.\n")
    assert outcome.exit_code == 1
