"""The video files that the tests of this folder share, written once a session."""

import itertools
import random
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest
from support.media import (
    punch_hole,
    truncate,
    write_audio_only,
    write_av1,
    write_cut,
    write_empty_video,
    write_size_change,
    write_still_end,
    write_trimmed_end,
    write_video,
)

# Uneven steps, of 2 to 7 ticks of 1/90 s.
VFR_PTS = list(itertools.accumulate(random.Random(1).choices((2, 3, 4, 7), k=89), initial=0))


def _write(path: Path, find: Callable[[str], Path]) -> Path:
    other = path.parent / "source"
    other.mkdir(exist_ok=True)
    recipes: dict[str, Callable[[], Path]] = {
        "plain.mp4": lambda: write_video(path),
        "b_frames.mp4": lambda: write_video(path, count=90, b_frames=2),
        "vfr.mp4": lambda: write_video(
            path, count=90, b_frames=2, pts=VFR_PTS, time_base=Fraction(1, 90)
        ),
        "fragmented.mp4": lambda: write_video(
            path, b_frames=2, container_options={"movflags": "frag_keyframe+empty_moov"}
        ),
        "open_gop_hevc.mp4": lambda: write_video(
            path,
            codec="libx265",
            b_frames=2,
            options={"x265-params": "log-level=none:open-gop=1:keyint=15:pools=none"},
        ),
        "cut.mp4": lambda: write_cut(write_video(other / "cut.mp4", b_frames=2), path, 0.7),
        "cut.mkv": lambda: write_cut(write_video(other / "cut2.mp4", b_frames=2), path, 0.7),
        "cut_open_gop.ts": lambda: write_cut(find("open_gop_hevc.mp4"), path, 1.2),
        "still_end.mp4": lambda: write_still_end(find("plain.mp4"), path, 10),
        "trimmed_end.mp4": lambda: write_trimmed_end(find("plain.mp4"), path, 1.5),
        "long_sound.mp4": lambda: write_video(path, b_frames=2, audio_seconds=5),
        "long_sound.mkv": lambda: write_video(path, b_frames=2, audio_seconds=5),
        "late_start.mkv": lambda: write_video(path, pts=[150 + k for k in range(60)]),
        "stream.ts": lambda: write_video(path, b_frames=2),
        "mpeg4.avi": lambda: write_video(path),
        "mpeg4_b.avi": lambda: write_video(path, b_frames=2),
        "h264_b.avi": lambda: write_video(path, codec="libx264", b_frames=2),
        "raw.h264": lambda: write_video(path, b_frames=2),
        "vp8.webm": lambda: write_video(path),
        "turned_90.mp4": lambda: write_video(path, rotation_degrees=90),
        "turned_180.mp4": lambda: write_video(path, rotation_degrees=180),
        "turned_270.mp4": lambda: write_video(path, rotation_degrees=270),
        "grey.mkv": lambda: write_video(path, codec="ffv1", pixel_format="gray"),
        "grey_10_bit.mkv": lambda: write_video(path, codec="ffv1", pixel_format="gray10le"),
        "wide_pixels.mp4": lambda: write_video(path, pixel_aspect_ratio=Fraction(4, 3)),
        "av1.mp4": lambda: write_av1(path, count=20),
        "truncated.mp4": lambda: truncate(
            write_video(other / "fs.mp4", b_frames=2, container_options={"movflags": "faststart"}),
            path,
            0.7,
        ),
        "truncated.mkv": lambda: truncate(write_video(other / "t.mkv", b_frames=2), path, 0.6),
        "truncated.avi": lambda: truncate(write_video(other / "t.avi", b_frames=2), path, 0.6),
        "no_index.mp4": lambda: truncate(write_video(other / "n.mp4"), path, 0.6),
        "hole.ts": lambda: punch_hole(
            write_video(other / "hole.ts", count=90, b_frames=2), path, 0.4, 0.55
        ),
        "ycgco.mp4": lambda: write_video(path, options={"x264-params": "colormatrix=YCgCo"}),
        "size_change.ts": lambda: write_size_change(path),
        "size_change.webm": lambda: write_size_change(path),
        "empty.mp4": lambda: write_empty_video(path),
        "sound_only.mp4": lambda: write_audio_only(path),
    }
    return recipes[path.name]()


@pytest.fixture(scope="session")
def media(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Return a function that gives the path of a video of this name, writing it if needed."""
    folder = tmp_path_factory.mktemp("media")

    def find(name: str) -> Path:
        path = folder / name
        return path if path.exists() else _write(path, find)

    return find
