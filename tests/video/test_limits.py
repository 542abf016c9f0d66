"""What is beyond a limit is refused before it costs memory, and the error names the setting."""

import numpy as np
import pytest
from support.bombs import write_frame_claim, write_huge_keyframe, write_huge_picture
from support.media import (
    read_index,
    remux,
    write_image_folder,
    write_size_change,
    write_video,
)
from support.traps import write_two_streams

from situp_annotate.errors import FrameSizeError, VideoTooLargeError
from situp_annotate.limits import Limits
from situp_annotate.video import VideoFootage, image_folder, open_video, opening
from situp_annotate.video.mp4_claims import claimed_pictures
from situp_annotate.video.source import FrameSource

PIXELS = 64 * 48


@pytest.mark.parametrize("name", ["a.mp4", "a.ts", "a.webm", "a.avi"])
def test_pictures_may_be_as_large_as_the_limit_and_no_larger(name, tmp_path):
    path = write_video(tmp_path / name, count=5)
    with open_video(path, limits=Limits(max_pixels=PIXELS)) as source:
        assert len(list(source)) == 5
    with pytest.raises(
        VideoTooLargeError, match=r"the picture has 64 × 48 .*limits\.max_pixels = 3071 allows"
    ):
        open_video(path, limits=Limits(max_pixels=PIXELS - 1))


def test_pictures_in_folders_likewise(tmp_path):
    write_image_folder(tmp_path, 3)
    with open_video(tmp_path, limits=Limits(max_pixels=PIXELS)) as source:
        assert len(list(source)) == 3
    with pytest.raises(VideoTooLargeError, match=r"1\.png has 64 × 48 .*limits\.max_pixels"):
        open_video(tmp_path, limits=Limits(max_pixels=PIXELS - 1))


@pytest.mark.parametrize("incomplete", ["fail", "keep"])
@pytest.mark.parametrize("name", ["a.ts", "a.webm", "in_pictures.mp4", "in_pictures.mkv"])
def test_pictures_that_become_too_large_midway_are_refused_beforehand(name, incomplete, tmp_path):
    path = tmp_path / name
    if path.stem == "in_pictures":  # where no parameter sets should be
        remux(write_size_change(tmp_path / "a.ts"), path)
    else:
        write_size_change(path)
    with pytest.raises(VideoTooLargeError, match=r"picture 20 has .*limits\.max_pixels = 5000"):
        open_video(path, incomplete=incomplete, limits=Limits(max_pixels=5000))


def test_pictures_of_which_only_the_decoder_knows_the_size(tmp_path):
    path = write_size_change(tmp_path / "a.mkv", codec="mjpeg", pixel_format="yuvj420p")
    with (
        open_video(path, limits=Limits(max_pixels=5000)) as source,
        pytest.raises(VideoTooLargeError, match=r"limits\.max_pixels = 5000"),
    ):
        list(source)
    assert source.frames_decoded == 20


def test_a_change_of_size_within_the_limit_is_found_wherever_it_is_told(tmp_path):
    # The new parameter sets are in the pictures, where an mp4 should not have any.
    path = remux(write_size_change(tmp_path / "a.ts"), tmp_path / "a.mp4")
    with open_video(path) as source, pytest.raises(FrameSizeError, match="at frame 20"):
        list(source)


@pytest.mark.parametrize("name", ["a.mp4", "a.ts", "a.h264"])
def test_too_many_frames(name, tmp_path):
    path = write_video(tmp_path / name, count=30)
    with open_video(path, limits=Limits(max_frames=30)) as source:
        assert source.skip_through() == 30
    with pytest.raises(VideoTooLargeError, match=r"limits\.max_frames = 29"):
        open_video(path, limits=Limits(max_frames=29))


def test_too_many_pictures(tmp_path):
    write_image_folder(tmp_path, 3)
    with pytest.raises(VideoTooLargeError, match=r"limits\.max_frames = 2"):
        open_video(tmp_path, limits=Limits(max_frames=2))


class EndlessDecoder:
    name = "endless"
    rotation_degrees = 0
    time_ns = None
    size_hw = (48, 64)

    def __init__(self):
        self._turns = iter(range(1000))  # endless enough, and the test ends all the same

    def advance(self):
        return next(self._turns, None) is not None

    def image(self):
        return np.zeros((48, 64), np.uint8)

    def close(self):
        pass


def test_a_decoder_that_never_ends_is_stopped(tmp_path):
    with open_video(write_video(tmp_path / "a.mp4", count=5)) as source:
        info = source.info
    endless = FrameSource(
        info, EndlessDecoder(), None, keep_incomplete=True, limits=Limits(max_frames=100)
    )
    with pytest.raises(VideoTooLargeError, match=r"limits\.max_frames = 100"):
        list(endless)
    assert endless.frames_decoded == 100


def test_an_index_that_claims_too_much_is_read_before_ffmpeg_believes_it(tmp_path, monkeypatch):
    path = write_frame_claim(tmp_path / "a.mp4", 5_000_001)
    monkeypatch.delattr("situp_annotate.video.probe.open_container")
    with pytest.raises(VideoTooLargeError, match=r"limits\.max_frames"):
        open_video(path)


def test_what_an_index_claims(tmp_path):
    assert claimed_pictures(write_frame_claim(tmp_path / "a.mp4", 77)) == 77
    assert claimed_pictures(write_video(tmp_path / "b.mp4")) == 0, "each has a size of its own"
    assert claimed_pictures(write_video(tmp_path / "c.mkv")) == 0
    (tmp_path / "d.mp4").write_bytes(b"\0\0\0\x08free" * 30_000)
    assert claimed_pictures(tmp_path / "d.mp4") == 0
    assert claimed_pictures(tmp_path / "nowhere.mp4") == 0


def test_a_huge_picture_is_never_decoded(tmp_path, monkeypatch):
    folder = write_image_folder(tmp_path, 2)
    write_huge_picture(folder / "2.png", side=8000)
    decode = image_folder.cv2.imdecode

    def decode_small(content, flags):
        assert len(content) < 1000
        return decode(content, flags)

    monkeypatch.setattr(image_folder.cv2, "imdecode", decode_small)
    with (
        open_video(folder) as source,
        pytest.raises(VideoTooLargeError, match=r"2\.png has 8000 × 8000"),
    ):
        list(source)


def test_a_huge_file_is_not_read_beyond_its_picture(tmp_path):
    folder = write_image_folder(tmp_path, 2)
    with (folder / "2.png").open("r+b") as file:
        file.truncate(2**40)
    with open_video(folder) as source:
        assert [read_index(frame.image) for frame in source] == [0, 1]


def test_opencv_gets_no_file_with_pictures_besides_the_videos(tmp_path, monkeypatch):
    monkeypatch.delattr(opening, "OpenCvDecoder")
    with open_video(write_two_streams(tmp_path / "a.mp4")) as source:
        assert source.info.decoder == "pyav"
        assert source.findings == ()


@pytest.mark.parametrize("first", [0, 2])
def test_a_keyframe_that_asks_for_gigabytes(first, tmp_path):
    with pytest.raises(VideoTooLargeError, match=r"limits\.max_pixels"):
        open_video(write_huge_keyframe(tmp_path / "a.webm", first=first))


def test_footage_keeps_to_the_limits_each_time_it_is_walked_through(tmp_path):
    path = write_video(tmp_path / "a.mp4", count=20)
    with VideoFootage(path, limits=Limits(max_frames=20)) as footage:
        assert len(list(footage.forward())) == 20
        write_video(path, count=21)
        with pytest.raises(VideoTooLargeError):
            list(footage.forward())
