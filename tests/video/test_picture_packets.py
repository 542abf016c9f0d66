"""Which videos' own coded pictures stand for their frames, and that they do."""

import itertools
import re
from fractions import Fraction

import av
import numpy as np
import pytest
from support.media import (
    draw_index,
    punch_hole,
    truncate,
    write_cut,
    write_image_folder,
    write_trimmed_end,
    write_video,
)
from support.pictures import decode_each

from situp_annotate.errors import VideoError
from situp_annotate.video import open_video
from situp_annotate.video.picture_packets import coded_pictures, why_not_passed_on

VFR_PTS = list(itertools.accumulate([2, 3, 7, 4] * 11, initial=0))
SOUND = {
    "plain.mp4": lambda path: write_video(path),
    "variable.mp4": lambda path: write_video(
        path, count=45, pts=VFR_PTS, time_base=Fraction(1, 90)
    ),
    "fragmented.mp4": lambda path: write_video(
        path, container_options={"movflags": "frag_keyframe+empty_moov"}
    ),
    "late.mkv": lambda path: write_video(path, pts=[150 + k for k in range(60)]),
    "stream.ts": lambda path: write_video(path),
    "odd_size.mp4": lambda path: write_video(path, size_hw=(46, 62)),
    "full_range.mp4": lambda path: write_video(path, pixel_format="yuvj420p"),
    "many_slices.mp4": lambda path: write_video(
        path, size_hw=(128, 128), options={"x264-params": "slices=4"}
    ),
    "hevc.mp4": lambda path: write_video(
        path, codec="libx265", options={"x265-params": "log-level=none:keyint=15:pools=none"}
    ),
    "hevc.mkv": lambda path: write_video(
        path,
        codec="libx265",
        options={"x265-params": "log-level=none:keyint=15:pools=none:open-gop=1"},
    ),
}
UNFIT = {
    "b_frames.mp4": (lambda path: write_video(path, b_frames=2), "B-frames"),
    "turned.mp4": (lambda path: write_video(path, rotation_degrees=90), "rotated"),
    "upside_down.mp4": (lambda path: write_video(path, rotation_degrees=180), "rotated"),
    "wide.mp4": (lambda path: write_video(path, pixel_aspect_ratio=Fraction(4, 3)), "square"),
    "mpeg4.avi": (lambda path: write_video(path), "is mpeg4"),
    "vp9.webm": (lambda path: write_video(path, codec="libvpx-vp9"), "is vp9"),
    "fine_colour.mp4": (lambda path: write_video(path, pixel_format="yuv444p"), "yuv444p"),
    "raw.h264": (lambda path: write_video(path), "no usable times"),
    "cut.mp4": (
        lambda path: write_cut(write_video(path.with_suffix(".mkv")), path, 0.7),
        "does not give frame 0",
    ),
    "cut_short.mp4": (
        lambda path: write_trimmed_end(write_video(path.with_name("whole.mp4")), path, 1.5),
        "does not give frame",
    ),
}


def read(path, incomplete="fail"):
    with open_video(path, incomplete=incomplete) as source:
        frames = list(source)
    return source.info, frames, [frame.pts_ns for frame in frames]


@pytest.mark.parametrize("name", SOUND)
def test_every_coded_picture_gives_its_frame(tmp_path, name):
    info, frames, times_ns = read(SOUND[name](tmp_path / name))
    assert why_not_passed_on(info, times_ns) is None
    images = decode_each(coded_pictures(info), info.codec)
    assert len(images) == len(frames)
    for image, frame in zip(images, frames, strict=True):
        assert np.array_equal(image, frame.image), frame.index


@pytest.mark.parametrize("name", UNFIT)
def test_why_others_are_not_passed_on(tmp_path, name):
    write, words = UNFIT[name]
    info, _, times_ns = read(write(tmp_path / name))
    assert words in why_not_passed_on(info, times_ns)


def test_only_codecs_that_are_allowed(tmp_path):
    info, _, times_ns = read(SOUND["hevc.mp4"](tmp_path / "hevc.mp4"))
    assert why_not_passed_on(info, times_ns, {"h264"}) == "the source is hevc"


def test_a_folder_of_pictures_has_none(tmp_path):
    info, _, times_ns = read(write_image_folder(tmp_path / "pictures"))
    assert why_not_passed_on(info, times_ns) == "the source is images"


@pytest.fixture
def plain(tmp_path):
    return read(write_video(tmp_path / "plain.mp4"))


def test_frames_and_pictures_must_be_the_same(plain):
    info, _, times_ns = plain
    assert why_not_passed_on(info, times_ns[:-1]) == (
        "coded picture 59 of the source does not give frame 59"
    )
    assert why_not_passed_on(info, [*times_ns, times_ns[-1] + 1]) == (
        "the source has 60 coded pictures for 61 frames"
    )
    late = [*times_ns[:7], times_ns[7] + 5_000_000, *times_ns[8:]]
    assert "picture 7 of" in why_not_passed_on(info, late)


def write_sets_once(path):
    """Write a stream whose parameter sets stand before the first keyframe only."""
    with (
        av.open(str(write_video(path.with_name("repeating.ts")))) as reader,
        av.open(str(path), "w") as writer,
    ):
        stream = writer.add_stream_from_template(reader.streams.video[0])
        for number, packet in enumerate(reader.demux(video=0)):
            if packet.size == 0:
                continue
            units = re.split(b"\0?\0\0\1", bytes(packet))
            kept = [unit for unit in units if not unit or unit[0] & 0x1F not in (7, 8)]
            fresh = av.Packet(b"\0\0\0\1".join(kept if number else units))
            fresh.pts, fresh.dts, fresh.time_base = packet.pts, packet.dts, packet.time_base
            # FFmpeg writes parameter sets before what it knows for keyframes.
            fresh.is_keyframe, fresh.stream = False, stream
            writer.mux(fresh)
    return path


def test_keyframes_need_their_parameter_sets(tmp_path):
    info, frames, times_ns = read(write_sets_once(tmp_path / "once.ts"))
    assert len(frames) == 60
    assert why_not_passed_on(info, times_ns) == "keyframe 15 of the source lacks its parameter sets"


DAMAGED = {
    "hole.ts": lambda source, path: punch_hole(source, path, 0.4, 0.55),
    "cut_off.ts": lambda source, path: truncate(source, path, 0.7),
    "cut_off.mkv": lambda source, path: truncate(source, path, 0.7),
}


@pytest.mark.parametrize("name", DAMAGED)
def test_nothing_of_a_damaged_video_is_shown_otherwise_than_decoded(tmp_path, name):
    whole = write_video(tmp_path / f"whole_{name}", size_hw=(240, 320), count=90)
    info, frames, times_ns = read(DAMAGED[name](whole, tmp_path / name), incomplete="keep")
    assert 30 < len(frames) < 90
    if why_not_passed_on(info, times_ns) is None:
        images = decode_each(coded_pictures(info), info.codec)
        assert all(map(np.array_equal, images, [frame.image for frame in frames]))


def test_a_video_that_is_gone_is_told_of(plain):
    info, _, _ = plain
    info.path.unlink()
    with pytest.raises(VideoError, match=r"plain\.mp4: the video cannot be read"):
        next(coded_pictures(info))


def test_pictures_carry_no_more_than_the_stream(tmp_path):
    noise = np.random.default_rng(5)
    pictures = [
        noise.integers(0, 60, (240, 320, 3), np.uint8) + draw_index(k, (240, 320)) // 2
        for k in range(60)
    ]
    info, _, times_ns = read(write_video(tmp_path / "noise.mp4", pictures, gop=30))
    assert why_not_passed_on(info, times_ns) is None
    with av.open(str(info.path)) as container:
        in_source = sum(packet.size for packet in container.demux(video=0))
    passed_on = sum(map(len, coded_pictures(info)))
    assert abs(passed_on / in_source - 1) < 0.02
