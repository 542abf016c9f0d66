"""One contract for every decoder and every kind of file; every failure by its own name."""

import os
import tracemalloc
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from support.media import (
    LIGHT_BGR,
    decode_with_pyav,
    draw_index,
    read_index,
    write_image_folder,
    write_video,
)

from situp_annotate.errors import (
    FrameSizeError,
    VideoEmptyError,
    VideoError,
    VideoFormatError,
    VideoIncompleteError,
    VideoMissingError,
)
from situp_annotate.types import Frame
from situp_annotate.video import FrameSource, open_video
from situp_annotate.video.opencv_decoder import OpenCvDecoder

Media = Callable[[str], Path]

TIMED = [
    "plain.mp4",
    "b_frames.mp4",
    "vfr.mp4",
    "fragmented.mp4",
    "open_gop_hevc.mp4",
    "cut.mp4",
    "cut.mkv",
    "long_sound.mp4",
    "long_sound.mkv",
    "late_start.mkv",
    "stream.ts",
    "mpeg4.avi",
    "vp8.webm",
    "turned_90.mp4",
    "turned_180.mp4",
    "turned_270.mp4",
    "grey.mkv",
    "grey_10_bit.mkv",
    "wide_pixels.mp4",
]
UNTIMED = ["mpeg4_b.avi", "h264_b.avi", "raw.h264"]
# OpenCV would not notice a change of size; PyAV decodes these whatever OpenCV can.
OF_ANY_SIZE = {"vp8.webm", "grey.mkv", "grey_10_bit.mkv"}


@pytest.fixture(params=["opencv", "pyav"])
def backend(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    name: str = request.param
    if name == "pyav":
        monkeypatch.setattr(OpenCvDecoder, "advance", lambda _: False)
    return name


def read_all(path: Path, **options: str) -> tuple[FrameSource, list[Frame]]:
    with open_video(path, **options) as source:
        return source, list(source)


def kinds(source: FrameSource) -> set[str]:
    return {finding.kind for finding in source.findings}


@pytest.mark.parametrize("name", TIMED + UNTIMED)
def test_every_frame_is_the_picture_that_was_put_there(
    name: str, backend: str, media: Media
) -> None:
    source, frames = read_all(media(name))
    pictures = [read_index(frame.image) for frame in frames]
    if "turned" not in name:  # PyAV's own pictures are not upright
        assert pictures == decode_with_pyav(media(name))[1]
    assert pictures == list(range(pictures[0], pictures[0] + len(frames)))
    assert [frame.index for frame in frames] == list(range(len(frames)))
    assert source.frames_decoded == len(frames)
    assert source.info.decoder == ("pyav" if name in OF_ANY_SIZE else backend)
    assert kinds(source) <= {"decoder", "timestamps"}


@pytest.mark.parametrize("name", [name for name in TIMED if "turned" not in name])
def test_times_are_the_streams_own(name: str, backend: str, media: Media) -> None:
    source, frames = read_all(media(name))
    seconds, _ = decode_with_pyav(media(name))
    assert source.info.timestamps == "stream"
    assert [frame.pts_ns for frame in frames] == [
        round(time * 10**9) for time in seconds if time is not None
    ]
    assert all(isinstance(frame.pts_ns, int) for frame in frames)
    assert frames[0].pts_ns == 0


@pytest.mark.parametrize("name", UNTIMED)
def test_without_usable_times_frames_are_timed_by_their_number(
    name: str, backend: str, media: Media
) -> None:
    source, frames = read_all(media(name))
    assert source.info.timestamps == "frame_rate"
    assert source.info.frame_rate == 30
    assert [frame.pts_ns for frame in frames] == [round(k * 10**9 / 30) for k in range(60)]
    assert "timestamps" in kinds(source)
    assert "timestamps" in {finding.kind for finding in frames[0].findings}


@pytest.mark.parametrize("name", [*TIMED, *UNTIMED, "av1.mp4"])
def test_skipping_counts_what_iterating_hands_out(name: str, backend: str, media: Media) -> None:
    with open_video(media(name)) as source:
        next(source)
        count = source.skip_through()
        assert list(source) == []
    whole, frames = read_all(media(name))
    assert count == len(frames)
    assert source.findings == whole.findings


def test_frames_that_an_edit_list_hides_are_not_counted(backend: str, media: Media) -> None:
    _, frames = read_all(media("cut.mp4"))
    assert [read_index(frame.image) for frame in frames] == list(range(21, 60))


def test_av1_is_decoded_by_whichever_decoder_can(media: Media) -> None:
    source, frames = read_all(media("av1.mp4"))
    assert [read_index(frame.image) for frame in frames] == list(range(20))
    assert source.info.codec == "av1"
    assert source.info.decoder == "pyav"
    # OpenCV 4.14 decodes AV1; 4.13 and 5.0 open it and get nothing.
    opencv = OpenCvDecoder(media("av1.mp4"), coded_pictures=20, grey=False)
    assert ("decoder" in kinds(source)) == (not opencv.advance())
    opencv.close()


@pytest.mark.parametrize("degrees", [90, 180, 270])
def test_pictures_are_turned_upright(degrees: int, backend: str, media: Media) -> None:
    source, frames = read_all(media(f"turned_{degrees}.mp4"))
    assert source.info.rotation_degrees == degrees
    assert (source.info.height, source.info.width) == (48, 64)
    assert frames[0].image.shape == (48, 64, 3)


@pytest.mark.parametrize("name", ["grey.mkv", "grey_10_bit.mkv"])
def test_a_grey_stream_gives_grey_pictures(name: str, backend: str, media: Media) -> None:
    _, frames = read_all(media(name))
    image = frames[5].image
    assert image.shape == (48, 64)
    assert image.dtype == np.uint8
    # Lossless; 10 bits are rounded to 8.
    difference = image.astype(int) - draw_index(5, grey=True)
    assert abs(difference).max() <= (2 if "10" in name else 0)


def test_colours_come_in_the_order_blue_green_red(backend: str, media: Media) -> None:
    _, frames = read_all(media("plain.mp4"))
    assert frames[0].image[6, 8] == pytest.approx(LIGHT_BGR, abs=20)
    assert frames[0].image.flags.c_contiguous


def test_colours_that_nobody_converts(media: Media) -> None:
    # OpenCV would give what was in its memory.
    source, frames = read_all(media("ycgco.mp4"))
    assert source.info.decoder == "pyav"
    assert [read_index(frame.image) for frame in frames] == list(range(60))


def test_info_of_a_file(media: Media) -> None:
    with open_video(media("wide_pixels.mp4")) as source:
        info = source.info
    assert info.codec == "h264"
    assert info.frame_rate == 30
    assert info.frame_count_from_header == 60
    assert info.pixel_aspect_ratio == Fraction(4, 3)


def test_pixel_aspect_ratio_is_that_of_the_upright_picture(tmp_path: Path) -> None:
    ratio = Fraction(4, 3)
    path = tmp_path / "turned.mp4"
    write_video(path, count=5, rotation_degrees=90, pixel_aspect_ratio=ratio)
    with open_video(path) as source:
        assert source.info.pixel_aspect_ratio == 1 / ratio


def test_pictures_that_are_days_apart_have_a_frame_rate(tmp_path: Path) -> None:
    times = [0, 200_000, 400_000]
    path = write_video(tmp_path / "v.mkv", count=3, pts=times, time_base=Fraction(1))
    with open_video(path, incomplete="keep") as source:
        assert source.info.frame_rate > 0
        assert len(list(source)) == 3


def test_frame_rate_of_a_variable_rate_is_the_average(media: Media) -> None:
    source, frames = read_all(media("vfr.mp4"))
    average = (len(frames) - 1) / (frames[-1].pts_ns * 1e-9)
    assert float(source.info.frame_rate) == pytest.approx(average, rel=1e-6)
    assert source.findings == ()


def test_ntsc_rate_is_exact_despite_millisecond_times(tmp_path: Path) -> None:
    rate = Fraction(30000, 1001)
    with open_video(write_video(tmp_path / "ntsc.mkv", rate=rate)) as source:
        assert source.info.frame_rate == rate


@pytest.mark.parametrize("name", ["truncated.mp4", "truncated.mkv", "truncated.avi"])
def test_a_short_read_is_an_error(name: str, backend: str, media: Media) -> None:
    with open_video(media(name)) as source, pytest.raises(VideoIncompleteError) as caught:
        list(source)
    message = str(caught.value)
    assert name in message
    assert f"{source.frames_decoded} frames" in message
    assert "of the 2.00 s" in message
    assert 'decoding.incomplete = "keep"' in message
    with open_video(media(name)) as source, pytest.raises(VideoIncompleteError):
        source.skip_through()


def test_a_short_read_can_be_kept(backend: str, media: Media) -> None:
    source, frames = read_all(media("truncated.mp4"), incomplete="keep")
    assert 10 < len(frames) < 50
    assert [read_index(frame.image) for frame in frames[:10]] == list(range(10))
    assert "incomplete" in kinds(source)
    assert list(source) == []


def test_pictures_that_do_not_decode_are_counted(tmp_path: Path, backend: str) -> None:
    path = write_video(tmp_path / "broken.mp4", b_frames=0, gop=5)
    content = bytearray(path.read_bytes())
    start = content.index(b"mdat") + 4
    middle = start + (content.index(b"moov") - start) // 2
    content[middle : middle + 250] = bytes([255]) * 250
    path.write_bytes(content)
    source, frames = read_all(path)
    assert len(frames) < 60
    assert read_index(frames[-1].image) == 59, "what follows the damage is decoded"
    undecoded = [finding for finding in source.findings if finding.kind == "undecoded"]
    assert undecoded[0].message.startswith(f"{60 - len(frames)} of 60 coded pictures")


def test_a_hole_is_found_by_the_times(media: Media, backend: str) -> None:
    source, frames = read_all(media("hole.ts"))
    gaps = [finding for finding in source.findings if finding.kind == "gap"]
    assert gaps[0].frame is not None
    assert "missing before frame" in gaps[0].message
    assert gaps[0] in frames[gaps[0].frame].findings
    times = [frame.pts_ns for frame in frames]
    assert times == sorted(set(times))


def test_one_dropped_frame_is_a_gap(tmp_path: Path, backend: str) -> None:
    pts = [k + (k >= 20) for k in range(40)]
    source, _ = read_all(write_video(tmp_path / "drop.mp4", count=40, pts=pts))
    (gap,) = (finding for finding in source.findings if finding.kind == "gap")
    assert gap.frame == 20
    assert gap.message.startswith("About 1 frame is missing before frame 20")


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("still_end.mp4", 60),  # the last picture stands for ten seconds
        ("trimmed_end.mp4", 45),  # an edit list hides the end
        ("cut_open_gop.ts", 30),  # pictures that build on what was cut away
    ],
)
def test_nothing_is_missing(name: str, count: int, backend: str, media: Media) -> None:
    source, frames = read_all(media(name))
    assert len(frames) == count
    assert kinds(source) <= {"decoder"}


@pytest.mark.parametrize("name", ["size_change.ts", "size_change.webm"])
def test_a_change_of_size_is_an_error(name: str, backend: str, media: Media) -> None:
    with open_video(media(name)) as source, pytest.raises(FrameSizeError) as caught:
        list(source)
    assert "64 × 48 to 96 × 80 pixels at frame 20" in str(caught.value)
    source, frames = read_all(media(name), incomplete="keep")
    assert [read_index(frame.image) for frame in frames] == list(range(20))
    assert "frame_size" in kinds(source)


@pytest.mark.parametrize(
    ("name", "error", "words"),
    [
        ("empty.mp4", VideoEmptyError, "no picture"),
        ("no_index.mp4", VideoFormatError, "cut off"),
        ("sound_only.mp4", VideoFormatError, "no video stream, only audio"),
    ],
)
def test_files_without_frames(name: str, error: type[VideoError], words: str, media: Media) -> None:
    with pytest.raises(error, match=words) as caught:
        open_video(media(name))
    assert type(caught.value) is error
    assert name in str(caught.value)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("text.mp4", "No video, but a text.\n" * 40),
        ("notes.txt", "No video, but a text.\n" * 40),
        ("list.mp4", "ffconcat version 1.0\nfile other.mp4\n"),
        ("playlist.mp4", "#EXTM3U\n#EXT-X-TARGETDURATION:5\n#EXTINF:5,\nother.ts\n"),
        ("nothing.mp4", ""),
    ],
)
def test_texts_are_no_videos(name: str, content: str, tmp_path: Path) -> None:
    write_video(tmp_path / "other.mp4", count=5)
    (tmp_path / name).write_text(content)
    with pytest.raises(VideoFormatError, match=name):
        open_video(tmp_path / name)


def test_a_single_picture_is_no_video(tmp_path: Path) -> None:
    write_image_folder(tmp_path, count=1)
    with pytest.raises(VideoFormatError, match="single picture"):
        open_video(tmp_path / "1.png")


def test_nothing_there(tmp_path: Path) -> None:
    with pytest.raises(VideoMissingError, match=r"gone\.mp4.*correct the path"):
        open_video(tmp_path / "gone.mp4")


def test_a_name_that_is_no_text(tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"\xff.mp4")
    try:
        write_video(tmp_path / "a.mp4", count=5).rename(path)
    except OSError:
        pytest.skip("this file system has no such names")
    with pytest.raises(VideoMissingError, match="not valid UTF-8") as caught:
        open_video(path)
    str(caught.value).encode()


def test_times_that_no_clock_can_tell(tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.avi", count=20)
    content = bytearray(path.read_bytes())
    rate = content.index(b"strh") + 28
    content[rate : rate + 8] = b"\1\0\0\0\xff\xff\xff\xff"  # 2³² pictures a second
    path.write_bytes(content)
    _, frames = read_all(path, incomplete="keep")
    times = [frame.pts_ns for frame in frames]
    assert times == sorted(set(times))


def test_a_codec_that_nobody_decodes(media: Media, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(OpenCvDecoder, "advance", lambda _: False)
    monkeypatch.setattr("situp_annotate.video.opening.PyAvDecoder.advance", lambda _: False)
    with pytest.raises(VideoEmptyError, match="not a single frame of it decodes"):
        open_video(media("plain.mp4"))


def test_a_path_is_never_a_protocol(
    tmp_path: Path, media: Media, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    name = Path("concat:a.mp4")
    name.write_bytes(media("plain.mp4").read_bytes())
    assert len(read_all(name)[1]) == 60


def test_a_folder_of_pictures_in_natural_order(tmp_path: Path) -> None:
    source, frames = read_all(write_image_folder(tmp_path / "seq", count=12))
    assert [read_index(frame.image) for frame in frames] == list(range(12))
    assert [frame.pts_ns for frame in frames] == [k * 40_000_000 for k in range(12)]
    assert (source.info.decoder, source.info.codec) == ("images", "images")
    assert source.info.timestamps == "frame_rate"
    assert source.findings == ()
    with open_video(tmp_path / "seq") as source:
        assert source.skip_through() == 12


def test_otb_layout(tmp_path: Path) -> None:
    write_image_folder(tmp_path / "Dog" / "img", count=5, digits=4, suffix=".jpg", grey=True)
    (tmp_path / "Dog" / "groundtruth_rect.txt").write_text("1,1,4,4\n")
    _, frames = read_all(tmp_path / "Dog")
    assert [read_index(frame.image) for frame in frames] == list(range(5))
    assert frames[0].image.ndim == 2


def test_an_unreadable_picture_is_named(tmp_path: Path) -> None:
    folder = write_image_folder(tmp_path / "seq", count=12)
    (folder / "7.png").write_bytes(b"no picture")
    with open_video(folder) as source, pytest.raises(VideoIncompleteError, match=r"7\.png"):
        list(source)
    source, frames = read_all(folder, incomplete="keep")
    assert len(frames) == 6
    assert source.findings[0].kind == "incomplete"
    assert source.findings[0].frame == 6


def test_pictures_of_two_sizes(tmp_path: Path) -> None:
    folder = write_image_folder(tmp_path / "seq", count=3)
    write_image_folder(tmp_path / "other", count=1, size_hw=(60, 80))
    (tmp_path / "other" / "1.png").rename(folder / "9.png")
    with open_video(folder) as source, pytest.raises(FrameSizeError, match="at frame 3"):
        source.skip_through()


def test_a_folder_without_pictures(tmp_path: Path) -> None:
    with pytest.raises(VideoFormatError, match="holds no pictures"):
        open_video(tmp_path)


def test_memory_holds_a_few_frames_however_long_the_video(tmp_path: Path, backend: str) -> None:
    size_hw = (1080, 1920)
    still = draw_index(0, size_hw)
    path = write_video(
        tmp_path / "full_hd.mp4", (still for _ in range(24)), options={"preset": "ultrafast"}
    )
    with open_video(path) as source:
        next(source)
        tracemalloc.start()
        for _ in source:
            pass
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    assert source.frames_decoded == 24
    assert peak < 4 * still.nbytes


def test_a_title_in_another_encoding_does_no_harm(tmp_path):
    path = write_video(tmp_path / "a.mkv", count=5)
    path.write_bytes(path.read_bytes().replace(b"Lavf", b"L\xe4vf"))
    with open_video(path) as source:
        assert len(list(source)) == 5
