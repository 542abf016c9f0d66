"""Each trap in a video is remarked on, and only there."""

import itertools
import random
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest
from support import traps
from support.media import (
    punch_hole,
    truncate,
    write_audio_only,
    write_av1,
    write_cut,
    write_empty_video,
    write_size_change,
    write_trimmed_end,
    write_unknown_sound,
    write_video,
)

from situp_annotate.inspection import Grade, inspect_path

UNEVEN_STEPS = list(itertools.accumulate(random.Random(1).choices((2, 3, 4, 7), k=89), initial=0))
WITHOUT_A_FRAME = [index + (index >= 30) for index in range(59)]
HDR = {"color_trc": "smpte2084", "x265-params": "log-level=none:pools=none:bframes=0"}
INTERLACED = {"flags": "+ildct+ilme", "x264-params": "tff=1"}


def cut(path: Path) -> Path:
    return write_cut(write_video(path.with_name(f"whole_{path.name}")), path, 0.7)


def truncated(path: Path) -> Path:
    whole = write_video(path.with_name("whole.mp4"), container_options={"movflags": "faststart"})
    return truncate(whole, path, 0.7)


def hole(path: Path) -> Path:
    whole = write_video(path.with_name("whole_hole.ts"), count=90)
    return punch_hole(whole, path, 0.4, 0.55)


def without_index(path: Path) -> Path:
    return truncate(write_video(path.with_name("whole_index.mp4")), path, 0.6)


def trimmed(path: Path) -> Path:
    return write_trimmed_end(write_video(path.with_name("whole_trim.mp4")), path, 1.5)


RECIPES: dict[str, Callable[[Path], Path]] = {
    "plain.mp4": write_video,
    "sound.mp4": lambda path: write_video(path, audio_seconds=2),
    "vp8.webm": write_video,
    "one.mp4": lambda path: write_video(path, count=1),
    "b_frames.mp4": lambda path: write_video(path, b_frames=2),
    "vfr.mp4": lambda path: write_video(
        path, count=90, pts=UNEVEN_STEPS, time_base=Fraction(1, 90)
    ),
    "uneven.mp4": traps.write_uneven,
    "gap.mp4": lambda path: write_video(path, count=59, pts=WITHOUT_A_FRAME),
    "cut.mp4": cut,
    "trimmed.mp4": trimmed,
    "late.mkv": lambda path: write_video(path, pts=[150 + index for index in range(60)]),
    "raw.h264": write_video,
    "reordered.avi": lambda path: write_video(path, codec="libx264", b_frames=2),
    "header_rate.avi": traps.write_wrong_header_rate,
    "turned.mp4": lambda path: write_video(path, size_hw=(64, 48), rotation_degrees=90),
    "mirrored.mp4": traps.write_mirrored,
    "upside_down.mp4": lambda path: traps.write_mirrored(path, upside_down=True),
    "wide.mp4": lambda path: write_video(path, pixel_aspect_ratio=Fraction(4, 3)),
    "interlaced.mp4": lambda path: write_video(path, options=INTERLACED),
    "hdr.mp4": lambda path: write_video(
        path, codec="libx265", pixel_format="yuv420p10le", options=HDR
    ),
    "deep.mp4": lambda path: write_video(path, pixel_format="yuv420p10le"),
    "alpha.mkv": lambda path: write_video(path, codec="ffv1", pixel_format="yuva420p"),
    "two.mp4": traps.write_two_streams,
    "long_group.mp4": lambda path: write_video(
        path, count=310, gop=1000, options={"sc_threshold": "0"}
    ),
    "named.mp4": lambda path: write_video(path, container_format="matroska"),
    "no_keyframe.ts": traps.write_without_first_keyframe,
    "av1.mp4": lambda path: write_av1(path, count=10),
    "truncated.mp4": truncated,
    "hole.ts": hole,
    "size_change.ts": write_size_change,
    "no_index.mp4": without_index,
    "empty.mp4": write_empty_video,
    "sound_only.mp4": write_audio_only,
}
KINDS = {
    "plain.mp4": [],
    "sound.mp4": [],
    "vp8.webm": [],
    "one.mp4": [],
    "b_frames.mp4": ["b_frames"],
    "vfr.mp4": ["vfr"],
    "uneven.mp4": ["drift"],
    "gap.mp4": ["gap", "drift"],
    "cut.mp4": ["edit_list"],
    "trimmed.mp4": ["edit_list"],
    "late.mkv": ["start"],
    "raw.h264": ["timestamps", "browser"],
    "reordered.avi": ["timestamps", "browser"],
    "header_rate.avi": ["header_count", "header_rate", "browser"],
    "turned.mp4": ["rotation"],
    "mirrored.mp4": ["mirrored"],
    "upside_down.mp4": ["mirrored"],
    "wide.mp4": ["pixel_aspect"],
    "interlaced.mp4": ["interlaced"],
    "hdr.mp4": ["hdr", "bit_depth", "browser"],
    "deep.mp4": ["bit_depth", "browser"],
    "alpha.mkv": ["alpha", "browser"],
    "two.mp4": ["streams"],
    "long_group.mp4": ["long_group"],
    "named.mp4": ["suffix"],
    "no_keyframe.ts": ["no_keyframe_at_start", "start", "browser"],
    "truncated.mp4": ["incomplete", "undecoded"],
    "hole.ts": ["gap", "drift", "browser"],
    "size_change.ts": ["frame_size", "browser"],
    "no_index.mp4": ["not_a_video"],
    "empty.mp4": ["no_frames"],
    "sound_only.mp4": ["not_a_video"],
}
PROBLEMS = {"truncated.mp4", "size_change.ts", "no_index.mp4", "empty.mp4", "sound_only.mp4"}
ONLY_DECODING_TELLS = {"undecoded"}


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    folder = tmp_path_factory.mktemp("media")

    def find(name):
        path = folder / name
        return path if path.exists() else RECIPES[name](path)

    return find


def kinds(report):
    return {remark.kind for remark in report.remarks}


@pytest.mark.parametrize("name", KINDS)
def test_what_bites_is_remarked_on_and_nothing_else(video, name):
    report = inspect_path(video(name))
    assert kinds(report) - {"undecoded"} == set(KINDS[name]) - {"undecoded"}
    assert (report.grade is Grade.PROBLEM) == (name in PROBLEMS)


@pytest.mark.parametrize("name", KINDS)
def test_quick_says_the_same_but_for_what_only_decoding_tells(video, name):
    report = inspect_path(video(name), quick=True)
    assert kinds(report) == set(KINDS[name]) - ONLY_DECODING_TELLS
    assert (report.grade is Grade.PROBLEM) == (name in PROBLEMS)


def test_av1_is_decoded_by_who_can(video):
    report = inspect_path(video("av1.mp4"))
    decoder = dict(report.facts)["codec"].rpartition(" ")[2]
    assert kinds(report) == ({"decoder"} if decoder == "pyav" else set())
    assert dict(report.facts)["frames"] == "10 decoded, 10 coded, 10 by the header"


def message(report, kind):
    return next(remark.message for remark in report.remarks if remark.kind == kind)


def test_how_far_counting_by_time_leads_astray(video):
    report = inspect_path(video("vfr.mp4"))
    seconds = [step / 90 for step in UNEVEN_STEPS]
    rate = 89 / seconds[-1]
    worst = max(abs(round(time * rate) - index) for index, time in enumerate(seconds))
    assert f"off by up to {worst} frames;" in message(report, "vfr")
    assert "22.22 to 77.78 ms, usually 33.33 ms" in message(report, "vfr")


def test_how_many_pictures_an_edit_list_hides(video):
    # Cut at 0.7 s, frame 21, of a video with keyframes at 0, 15, 30: 15 to 20 are hidden.
    assert "hides 6 coded pictures" in message(inspect_path(video("cut.mp4")), "edit_list")
    assert "hides 15 coded pictures" in message(inspect_path(video("trimmed.mp4")), "edit_list")


def test_a_gap_says_where_and_how_long(video):
    decoded = message(inspect_path(video("gap.mp4")), "gap")
    assert "About 1 frame is missing before frame 30" in decoded
    quick = message(inspect_path(video("gap.mp4"), quick=True), "gap")
    assert quick.startswith("1 gap in the times: the longest step is 67 ms")


def test_the_upright_picture_is_told(video):
    told = message(inspect_path(video("turned.mp4")), "rotation")
    assert "90° clockwise. Boxes are for the upright picture, 48 × 64" in told


def test_facts_of_a_sound_video(video):
    report = inspect_path(video("sound.mp4"))
    assert report.title == "H.264 (High) video, 64 × 48, 60 frames"
    facts = dict(report.facts)
    assert facts["frames"] == "60 decoded, 60 coded, 60 by the header"
    assert facts["frame rate"] == "30 frames/s, constant: steps of 33.33 ms"
    assert facts["keyframes"] == "5, at most 15 pictures apart"
    assert (facts["B-frames"], facts["sound"]) == ("no", "aac")


def test_a_picture_in_months(tmp_path):
    path = tmp_path / "slow.mkv"
    write_video(path, count=3, pts=[0, 10**7, 3 * 10**7], time_base=Fraction(1))
    assert dict(inspect_path(path).facts)["frames"].startswith("3 decoded")


def test_a_title_that_is_no_utf_8_does_not_make_it_fail(tmp_path):
    path = write_video(tmp_path / "a.mkv", count=5)
    path.write_bytes(path.read_bytes().replace(b"Lavf", b"L\xe4vf"))
    assert kinds(inspect_path(path)) == set()


def test_progress_is_reported_while_frames_are_decoded(video):
    told = []
    path = video("plain.mp4")
    inspect_path(path, on_progress=lambda done, total: told.append((done, total)))
    assert all(total == 60 and 0 <= done <= 60 for done, total in told)


@pytest.mark.parametrize(
    ("name", "grade", "expected"),
    [
        ("cf_tracking_sample.avi", Grade.NOTE, {"browser"}),
        ("cotracker_backpack.mp4", Grade.NOTE, {"b_frames"}),
        ("dlib_MOT20-05_short.mp4", Grade.WARNING, {"b_frames", "gap", "drift"}),
        ("mosse_surfer.mp4", Grade.NOTE, {"b_frames"}),
        ("pedestrians_topview.avi", Grade.WARNING, {"timestamps", "header_count", "browser"}),
        ("sam2_dog.mp4", Grade.NOTE, {"b_frames"}),
    ],
)
def test_real_clips(shared, name, grade, expected):
    report = inspect_path(shared / "clips" / name)
    assert (report.grade, kinds(report)) == (grade, expected)


def test_sound_of_an_unknown_codec_is_no_obstacle(tmp_path: Path) -> None:
    report = inspect_path(write_unknown_sound(tmp_path / "a.avi"))
    assert report.kind == "video"
    assert dict(report.facts)["sound"] == "of an unknown codec"
    assert report.grade is not Grade.PROBLEM
