"""Backward is forward reversed: the same frames whatever the file, the stretch and the budget."""

import dataclasses
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path

import av
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.media import write_image_folder, write_video

from situp_annotate.errors import FrameSizeError, VideoError, VideoMissingError
from situp_annotate.types import Frame, Image, VideoInfo
from situp_annotate.video import Rewinder, open_video, rewind
from situp_annotate.video.file_rewinder import FileRewinder
from situp_annotate.video.opencv_decoder import OpenCvDecoder
from situp_annotate.video.packet_index import IndexedStream

Media = Callable[[str], Path]

KINDS = [
    "plain.mp4",
    "b_frames.mp4",
    "vfr.mp4",
    "fragmented.mp4",
    "open_gop_hevc.mp4",
    "cut.mp4",
    "cut.mkv",
    "cut_open_gop.ts",
    "still_end.mp4",
    "trimmed_end.mp4",
    "long_sound.mp4",
    "long_sound.mkv",
    "late_start.mkv",
    "stream.ts",
    "mpeg4.avi",
    "mpeg4_b.avi",
    "h264_b.avi",
    "raw.h264",
    "vp8.webm",
    "turned_90.mp4",
    "turned_180.mp4",
    "turned_270.mp4",
    "grey.mkv",
    "grey_10_bit.mkv",
    "wide_pixels.mp4",
    "av1.mp4",
    "truncated.mp4",
    "truncated.mkv",
    "truncated.avi",
    "hole.ts",
    "size_change.ts",
    "size_change.webm",
    "ycgco.mp4",
]
# One picture of 64 × 48, a few of them, some groups of pictures, all.
BUDGETS = [1, 30_000, 150_000, 10**9]


@pytest.fixture(params=["opencv", "pyav"])
def backend(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    name: str = request.param
    if name == "pyav":
        monkeypatch.setattr(OpenCvDecoder, "advance", lambda _: False)
    return name


def read_forward(path: Path) -> tuple[VideoInfo, list[Frame]]:
    with open_video(path, incomplete="keep") as source:
        return source.info, list(source)


def times_of(frames: list[Frame]) -> list[int]:
    return [frame.pts_ns for frame in frames]


def assert_reversed(backward: list[Frame], forward: list[Frame]) -> None:
    assert [frame.index for frame in backward] == [frame.index for frame in reversed(forward)]
    assert [frame.pts_ns for frame in backward] == [frame.pts_ns for frame in reversed(forward)]
    for ours, theirs in zip(backward, reversed(forward), strict=True):
        assert ours.image.dtype == np.uint8
        assert ours.image.flags.c_contiguous
        assert np.array_equal(ours.image, theirs.image), f"another picture at {ours.index}"


def picture_bytes(path: Path) -> int:
    with av.open(str(path)) as container:
        frame = next(container.decode(container.streams.video[0]))
        return sum(plane.buffer_size for plane in frame.planes)


def moving_scene(count: int, size_hw: tuple[int, int] = (48, 64)) -> Iterator[Image]:
    """Noise that moves by a pixel a frame, so that frames are built on one another."""
    height, width = size_hw
    scene = np.random.default_rng(5).integers(0, 256, (height, width + count, 3), dtype=np.uint8)
    for k in range(count):
        yield np.ascontiguousarray(scene[:, k : k + width])


@pytest.fixture(scope="module")
def long_group(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One keyframe, then B- and P-frames: 90 pictures."""
    path = tmp_path_factory.mktemp("long") / "long_group.mp4"
    return write_video(path, moving_scene(90), b_frames=3, gop=250)


@pytest.mark.parametrize("name", KINDS)
def test_the_whole_video_backward(name: str, backend: str, media: Media) -> None:
    path = media(name)
    info, frames = read_forward(path)
    assert info.decoder in {backend, "pyav"}  # OpenCV may lack AV1
    for budget in BUDGETS:
        backward = rewind(path, info, times_of(frames), 0, len(frames), budget_bytes=budget)
        assert_reversed(list(backward), frames)


@pytest.mark.parametrize("name", ["b_frames.mp4", "cut.mp4", "stream.ts", "raw.h264", "hole.ts"])
def test_stretches_in_any_order(name: str, media: Media) -> None:
    path = media(name)
    info, frames = read_forward(path)
    count = len(frames)
    stretches = [(20, 31), (0, 1), (17, 18), (count - 1, count), (5, count - 5), (9, 9)]
    with Rewinder(path, info, times_of(frames), budget_bytes=40_000) as rewinder:
        for start, stop in stretches:
            assert_reversed(list(rewinder.walk(start, stop)), frames[start:stop])


@settings(
    max_examples=25,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(data=st.data())
def test_no_budget_and_no_stretch_changes_a_frame(
    data: st.DataObject, media: Media, long_group: Path
) -> None:
    name = data.draw(st.sampled_from(["vfr.mp4", "open_gop_hevc.mp4", "mpeg4_b.avi", "long"]))
    path = long_group if name == "long" else media(name)
    info, frames = read_forward(path)
    start = data.draw(st.integers(0, len(frames)))
    stop = data.draw(st.integers(start, len(frames)))
    budget = data.draw(st.integers(0, 4608 * 100))
    backward = rewind(path, info, times_of(frames), start, stop, budget_bytes=budget)
    assert_reversed(list(backward), frames[start:stop])


@pytest.mark.parametrize(
    ("suffix", "codec", "options"),
    [
        (".mkv", "libx264", {"x264-params": "open-gop=1:keyint=12:b-pyramid=normal:scenecut=0"}),
        (".ts", "libx264", {"x264-params": "intra-refresh=1:keyint=15"}),
        (".ts", "mpeg2video", {}),
        (".mpg", "mpeg2video", {}),
        (".mkv", "mpeg4", {}),
        (".flv", "libx264", {}),
        (".webm", "libvpx-vp9", {"cpu-used": "8", "lag-in-frames": "10"}),
    ],
)
def test_codecs_and_their_groups_of_pictures(
    suffix: str, codec: str, options: dict[str, str], tmp_path: Path
) -> None:
    path = write_video(
        tmp_path / f"clip{suffix}", moving_scene(60), codec=codec, b_frames=2, options=options
    )
    info, frames = read_forward(path)
    assert len(frames) == 60
    for budget in BUDGETS:
        backward = rewind(path, info, times_of(frames), 0, 60, budget_bytes=budget)
        assert_reversed(list(backward), frames)


@pytest.mark.parametrize("pixel_format", ["yuv420p10le", "yuv422p", "yuv444p", "yuvj420p"])
def test_pixels_are_opencvs(pixel_format: str, tmp_path: Path) -> None:
    path = write_video(tmp_path / "clip.mp4", moving_scene(6), pixel_format=pixel_format)
    info, frames = read_forward(path)
    assert info.decoder == "opencv"
    assert_reversed(list(rewind(path, info, times_of(frames), 0, 6, budget_bytes=1)), frames)


def test_times_that_were_moved_in_reading_forward(tmp_path: Path, media: Media) -> None:
    path = tmp_path / "double.mp4"
    with av.open(str(media("plain.mp4"))) as reader, av.open(str(path), "w") as writer:
        original = reader.streams.video[0]
        copy = writer.add_stream_from_template(original)
        for number, packet in enumerate(reader.demux(original)):
            if packet.dts is not None and packet.pts is not None:
                step = packet.duration
                packet.dts -= 5 * step
                packet.pts -= step if number == 20 else 0
                packet.stream = copy
                writer.mux(packet)
    info, frames = read_forward(path)
    assert info.timestamps == "stream"
    assert frames[20].pts_ns - frames[19].pts_ns < frames[19].pts_ns - frames[18].pts_ns
    for budget in BUDGETS:
        backward = rewind(path, info, times_of(frames), 0, 60, budget_bytes=budget)
        assert_reversed(list(backward), frames)


@pytest.mark.parametrize("seed", range(6))
def test_damage_moves_no_index(seed: int, tmp_path: Path, backend: str) -> None:
    path = write_video(tmp_path / "broken.ts", b_frames=2)
    content = bytearray(path.read_bytes())
    rng = np.random.default_rng(seed)
    for place in rng.integers(len(content) // 3, len(content) - 300, 3):
        content[place : place + 200] = rng.bytes(200)
    path.write_bytes(content)
    info, frames = read_forward(path)
    for budget in BUDGETS:
        backward = list(rewind(path, info, times_of(frames), 0, len(frames), budget_bytes=budget))
        assert [frame.index for frame in backward] == list(reversed(range(len(frames))))
        assert [frame.pts_ns for frame in backward] == times_of(frames)[::-1]
        alike = [
            np.array_equal(ours.image, theirs.image)
            for ours, theirs in zip(backward, reversed(frames), strict=True)
        ]
        assert sum(alike) >= 0.7 * len(frames), "only where data are broken pictures may differ"


def test_no_more_is_held_than_the_budget_allows(long_group: Path, media: Media) -> None:
    for path in (long_group, media("grey.mkv"), media("raw.h264")):
        info, frames = read_forward(path)
        one = picture_bytes(path)
        for budget, pictures in ((0, 1), (one, 1), (2 * one - 1, 1), (20 * one, 20)):
            with Rewinder(path, info, times_of(frames), budget_bytes=budget) as rewinder:
                assert len(list(rewinder.walk(0, len(frames)))) == len(frames)
                assert rewinder.peak_bytes <= pictures * one
                assert rewinder.peak_bytes >= min(pictures, 13) * one, "room is used"


def test_chunks_are_few_and_aligned_with_keyframes(
    media: Media, monkeypatch: pytest.MonkeyPatch
) -> None:
    starts: list[int] = []
    genuine = IndexedStream.from_keyframe

    def noting(self: IndexedStream, first: int, **options: object) -> object:
        starts.append(first)
        return genuine(self, first, **options)

    monkeypatch.setattr(IndexedStream, "from_keyframe", noting)
    path = media("plain.mp4")  # keyframes at 0, 15, 30, …
    info, frames = read_forward(path)
    # 40 pictures fit: 20 to 59, but 30 to 59 come without decoding 15 to 19 in vain.
    budget = 40 * picture_bytes(path)
    list(rewind(path, info, times_of(frames), 0, 60, budget_bytes=budget))
    assert starts == [30, 0]


def test_a_group_that_does_not_fit_is_decoded_once_a_chunk(
    long_group: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    decoded = []
    genuine = IndexedStream._pictures

    def counting(self: IndexedStream, packet: object) -> list[av.VideoFrame]:
        frames = genuine(self, packet)
        decoded.append(len(frames))
        return frames

    info, frames = read_forward(long_group)
    budget = 30 * picture_bytes(long_group)
    monkeypatch.setattr(IndexedStream, "_pictures", counting)
    with Rewinder(long_group, info, times_of(frames), budget_bytes=budget) as rewinder:
        assert_reversed(list(rewinder.walk(0, 90)), frames)
    # Three chunks decode 90, 60 and 30 pictures, but for those on which nothing is built.
    assert sum(decoded) < 180


def test_a_folder_of_pictures(tmp_path: Path) -> None:
    for grey in (False, True):
        folder = write_image_folder(tmp_path / f"grey_{grey}", count=12, grey=grey)
        info, frames = read_forward(folder)
        assert_reversed(list(rewind(folder, info, times_of(frames), 0, 12, budget_bytes=0)), frames)
        with Rewinder(folder, info, times_of(frames), budget_bytes=0) as rewinder:
            assert_reversed(list(rewinder.walk(3, 7)), frames[3:7])
            assert rewinder.peak_bytes == 0


def test_a_folder_that_has_lost_a_picture(tmp_path: Path) -> None:
    folder = write_image_folder(tmp_path / "seq", count=5)
    info, frames = read_forward(folder)
    (folder / "3.png").unlink()
    with pytest.raises(VideoError, match="holds 4 pictures where 5 were read"):
        list(rewind(folder, info, times_of(frames), 0, 5, budget_bytes=0))


def test_the_file_is_freed_though_the_walk_is_broken_off(
    media: Media, monkeypatch: pytest.MonkeyPatch
) -> None:
    closed: list[bool] = []
    genuine = FileRewinder.close

    def noting(self: FileRewinder) -> None:
        genuine(self)
        closed.append(True)

    monkeypatch.setattr(FileRewinder, "close", noting)
    path = media("plain.mp4")
    info, frames = read_forward(path)
    walk = rewind(path, info, times_of(frames), 0, 60, budget_bytes=1)
    assert next(walk).index == 59
    assert closed == []
    walk.close()  # type: ignore[attr-defined]
    assert closed == [True]


def test_a_stretch_that_is_not_in_the_video(media: Media) -> None:
    path = media("plain.mp4")
    info, frames = read_forward(path)
    with Rewinder(path, info, times_of(frames), budget_bytes=1) as rewinder:
        for start, stop in ((-1, 5), (5, 61), (6, 5)):
            with pytest.raises(ValueError, match="no stretch of 60 frames"):
                rewinder.walk(start, stop)


def test_frames_that_are_not_there_any_more(tmp_path: Path) -> None:
    path = write_video(tmp_path / "clip.mp4")
    info, frames = read_forward(path)
    write_video(path, count=40)
    with pytest.raises(VideoError, match=r"clip\.mp4: of the frames .* not all are found"):
        list(rewind(path, info, times_of(frames), 0, 60, budget_bytes=1))
    path.unlink()
    with pytest.raises(VideoMissingError):
        list(rewind(path, info, times_of(frames), 0, 60, budget_bytes=1))


def test_frames_of_another_size(media: Media) -> None:
    path = media("plain.mp4")
    info, frames = read_forward(path)
    other = dataclasses.replace(info, width=96)
    with pytest.raises(FrameSizeError, match="frame 59 has 64 × 48 pixels"):
        list(rewind(path, other, times_of(frames), 0, 60, budget_bytes=1))


def test_a_stream_without_seeking(media: Media, monkeypatch: pytest.MonkeyPatch) -> None:
    path = media("b_frames.mp4")
    info, frames = read_forward(path)
    monkeypatch.setattr(IndexedStream, "_sought", lambda *_: iter(()))
    backward = rewind(path, info, times_of(frames), 0, 90, budget_bytes=50_000)
    assert_reversed(list(backward), frames)


def test_a_seek_that_leads_astray(media: Media, monkeypatch: pytest.MonkeyPatch) -> None:
    path = media("b_frames.mp4")
    info, frames = read_forward(path)
    genuine = IndexedStream._is_number

    def doubting(self: IndexedStream, number: int, packet: object) -> bool:
        return number % 20 != 19 and genuine(self, number, packet)

    monkeypatch.setattr(IndexedStream, "_is_number", doubting)
    backward = rewind(path, info, times_of(frames), 0, 90, budget_bytes=50_000)
    assert_reversed(list(backward), frames)


def test_real_clips(shared: Path) -> None:
    for clip in sorted((shared / "clips").iterdir()):
        with open_video(clip, incomplete="keep") as source:
            times_ns: list[int] = []
            ends: deque[Frame] = deque(maxlen=24)
            for frame in source:
                times_ns.append(frame.pts_ns)
                ends.append(frame)
            info = source.info
        count = len(times_ns)
        budget = 10 * info.width * info.height
        stretch = rewind(clip, info, times_ns, count - len(ends), count, budget_bytes=budget)
        assert_reversed(list(stretch), list(ends))
