"""Videos written, decoded again with PyAV."""

import threading
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from support.media import draw_index, read_index

from situp_annotate.errors import OutputError
from situp_annotate.video.writer import H264Writer


def write(path, images, times_ns, **options):
    height, width = images[0].shape[:2]
    with H264Writer(path, width=width, height=height, frame_rate=Fraction(30), **options) as writer:
        for image, time_ns in zip(images, times_ns, strict=True):
            writer.write(image, time_ns)
    return path


def decode(path):
    with av.open(str(path)) as container:
        return list(container.decode(video=0))


def test_pictures_and_uneven_times_come_back(tmp_path):
    times = [0, 33_366_667, 66_733_333, 400_000_000, 400_500_000, 10_000_000_000]
    images = [draw_index(number) for number in range(6)]
    frames = decode(write(tmp_path / "v.mp4", images, times))
    assert [read_index(frame.to_ndarray(format="bgr24")) for frame in frames] == [0, 1, 2, 3, 4, 5]
    for frame, time in zip(frames, times, strict=True):
        assert float(frame.pts * frame.time_base) == pytest.approx(time / 1e9, abs=1 / 90_000)


def test_the_hint_may_be_odd(tmp_path):
    for rate in (Fraction(1, 65_535), Fraction(10**6)):
        images, times = [draw_index(0)] * 3, [0, 40_000_000, 80_000_000]
        with H264Writer(tmp_path / "v.mp4", width=64, height=48, frame_rate=rate) as writer:
            for image, time in zip(images, times, strict=True):
                writer.write(image, time)
        assert len(decode(tmp_path / "v.mp4")) == 3


def test_times_within_one_tick_stay_in_order(tmp_path):
    times = [0, 1000, 2000, 40_000_000]
    frames = decode(write(tmp_path / "v.mp4", [draw_index(0)] * 4, times))
    pts = [frame.pts for frame in frames]
    assert pts == sorted(set(pts))


def test_a_browser_can_play_it(tmp_path):
    path = write(
        tmp_path / "v.mp4", [draw_index(k) for k in range(5)], [k * 10**8 for k in range(5)]
    )
    content = path.read_bytes()
    assert content.index(b"moov") < content.index(b"mdat")
    with av.open(str(path)) as container:
        context = container.streams.video[0].codec_context
        assert (context.name, context.pix_fmt) == ("h264", "yuv420p")
        assert context.profile in {"High", "Main", "Constrained Baseline"}


@pytest.mark.parametrize("size", [(49, 64), (48, 65), (49, 65), (53, 67)])
@pytest.mark.parametrize("grey", [False, True])
def test_odd_sizes_are_padded_by_repetition(tmp_path, size, grey):
    image = np.full(size if grey else (*size, 3), 40, np.uint8)
    image[-1], image[:, -1] = 200, 200
    (frame,) = decode(write(tmp_path / "v.mp4", [image], [0], crf=1))
    assert (frame.height, frame.width) == (size[0] + size[0] % 2, size[1] + size[1] % 2)
    luma = frame.to_ndarray(format="gray")
    assert luma[-1, 5] > 150
    assert luma[5, -1] > 150
    assert luma[5, 5] < 90


def test_pixel_shape_is_kept(tmp_path):
    path = write(tmp_path / "v.mp4", [draw_index(0)], [0], pixel_aspect_ratio=Fraction(4, 3))
    with av.open(str(path)) as container:
        assert container.streams.video[0].sample_aspect_ratio == Fraction(4, 3)


def test_same_frames_give_the_same_bytes(tmp_path):
    images, times = [draw_index(k) for k in range(9)], [k * 40_000_000 for k in range(9)]
    first = write(tmp_path / "a.mp4", images, times).read_bytes()
    assert write(tmp_path / "b.mp4", images, times).read_bytes() == first


def test_bytes_are_the_same_from_the_background(tmp_path):
    images, times = [draw_index(k) for k in range(30)], [k * 40_000_000 for k in range(30)]
    first = write(tmp_path / "a.mp4", images, times).read_bytes()
    assert write(tmp_path / "b.mp4", images, times, background=True).read_bytes() == first


@pytest.mark.parametrize("size", [(48, 64), (50, 62), (270, 480), (1, 1)])
def test_pictures_of_any_even_size_come_back(tmp_path, size):
    rng = np.random.default_rng(3)
    small = rng.integers(0, 256, (max(size[0] // 16, 1), max(size[1] // 16, 1), 3), np.uint8)
    image = cv2.resize(small, size[::-1], interpolation=cv2.INTER_CUBIC)
    (frame,) = decode(write(tmp_path / "v.mp4", [image], [0], crf=1))
    back = frame.to_ndarray(format="bgr24")[: size[0], : size[1]].astype(int)
    assert np.abs(back - image).mean() < 6


def test_a_browser_that_jumps_has_two_seconds_to_decode_at_most(tmp_path):
    path = write(
        tmp_path / "v.mp4",
        [draw_index(k) for k in range(130)],
        [k * 10**9 // 30 for k in range(130)],
    )
    with av.open(str(path)) as container:
        keys = [k for k, packet in enumerate(container.demux(video=0)) if packet.is_keyframe]
    assert keys == [0, 60, 120]


def test_a_failure_passes_through(tmp_path):
    with (
        pytest.raises(ZeroDivisionError),
        H264Writer(tmp_path / "v.mp4", width=64, height=48, frame_rate=Fraction(30)),
    ):
        raise ZeroDivisionError


@pytest.mark.parametrize("background", [False, True])
def test_a_full_disk_is_told_as_it_is(background):
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("no /dev/full here")
    before = threading.active_count()
    rng = np.random.default_rng(0)
    images = [rng.integers(0, 256, (240, 320, 3), np.uint8) for _ in range(60)]
    with pytest.raises(OSError, match="No space left on device"):
        write(full, images, [k * 40_000_000 for k in range(60)], background=background)
    assert threading.active_count() == before


def test_what_cannot_be_encoded_is_an_output_error(tmp_path):
    with pytest.raises(OutputError, match=r"^v\.mp4: this video cannot be encoded: "):
        write(tmp_path / "v.mp4", [draw_index(0)], [0], preset="no such preset")


@pytest.mark.parametrize("background", [False, True])
@pytest.mark.parametrize("written", [0, 60])
def test_nothing_is_open_after_a_failure_and_no_index_written(tmp_path, background, written):
    path = tmp_path / "v.mp4"
    options = {"width": 64, "height": 48, "frame_rate": Fraction(30), "background": background}
    with (
        pytest.raises(ZeroDivisionError),
        H264Writer(path, **options) as writer,
    ):
        for index in range(written):
            writer.write(draw_index(index), index * 40_000_000)
        raise ZeroDivisionError
    with pytest.raises(ValueError, match="closed"):
        writer._file.write(b"more")
    assert b"moov" not in path.read_bytes()


def test_a_path_is_never_taken_for_a_protocol(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for folder in ("http:", "concat:", "file:", "-", "pipe:1"):
        (tmp_path / folder).mkdir()
        path = write(Path(folder) / "v.mp4", [draw_index(0)], [0])
        assert len(decode(path.absolute())) == 1


def test_the_colour_matrix_is_said_and_true(tmp_path):
    image = np.full((48, 64, 3), (40, 200, 60), np.uint8)
    (frame,) = decode(write(tmp_path / "v.mp4", [image], [0]))
    assert (frame.colorspace, frame.color_range) == (1, 1)  # BT.709, limited
    assert np.abs(frame.to_ndarray(format="bgr24").astype(int) - image).max() <= 4
