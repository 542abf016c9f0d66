"""A video is the file at its path: nothing in it, and nothing about its name, opens another."""

import os
import socket
import threading
from contextlib import suppress
from pathlib import Path

import pytest
from support.lures import LURES
from support.media import read_index, write_image_folder, write_video

from situp_annotate.errors import VideoError, VideoFormatError
from situp_annotate.video import fingerprint, open_video
from situp_annotate.video.opencv_decoder import OpenCvDecoder
from situp_annotate.video.probe import probe_video
from situp_annotate.video.pyav_stream import open_container


def leave_unread(path):
    """Have the file system note the next time that somebody reads the file; skip where not."""
    os.utime(path, (0, path.stat().st_mtime))


def was_read(path):
    return path.stat().st_atime > 0


@pytest.fixture
def target(tmp_path):
    """A video that nobody reads."""
    path = write_video(tmp_path / "target.ts", count=30)
    leave_unread(path)
    path.read_bytes()
    if not was_read(path):
        pytest.skip("this file system does not note when files are read")
    leave_unread(path)
    return path


class Server:
    """Notes who calls, and hangs up."""

    def __init__(self, listening):
        self.callers = []
        self.address = f"127.0.0.1:{listening.getsockname()[1]}"
        self._listening = listening

    def serve(self):
        with suppress(OSError):  # until it is closed
            while True:
                connection, caller = self._listening.accept()
                self.callers.append(caller)
                connection.close()


@pytest.fixture
def server():
    """A server that nobody calls."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        server = Server(listening)
        thread = threading.Thread(target=server.serve)
        thread.start()
        yield server
        listening.shutdown(socket.SHUT_RDWR)
        thread.join()


def opened_by_opencv(path):
    """Whether OpenCV alone, with no check before it, gets a picture."""
    decoder = OpenCvDecoder(path, coded_pictures=30, grey=False)
    try:
        return decoder.advance()
    finally:
        decoder.close()


@pytest.mark.parametrize("name", LURES)
def test_no_other_file_is_opened(name, target, tmp_path):
    path = tmp_path / name
    LURES[name](path, str(target))
    with pytest.raises(VideoError):
        open_video(path)
    assert not opened_by_opencv(path)
    assert not was_read(target)


@pytest.mark.parametrize("name", LURES)
def test_no_address_is_called(name, server, tmp_path):
    path = tmp_path / name
    LURES[name](path, f"http://{server.address}/target.ts")
    with pytest.raises(VideoError):
        open_video(path)
    assert not opened_by_opencv(path)
    assert server.callers == []


@pytest.mark.parametrize("name", ["img%03d.png", "img%03d.jpg"])
def test_a_name_does_not_stand_for_others(name, tmp_path):
    write_image_folder(tmp_path, 3)
    for number in (1, 2, 3):
        picture = (tmp_path / f"{number}.png").rename(tmp_path / f"img00{number}{name[-4:]}")
        leave_unread(picture)
    pattern = write_video(tmp_path / name, container_format="mp4", count=5)
    with pytest.raises(VideoFormatError):
        open_video(pattern)
    assert not opened_by_opencv(pattern)
    assert not any(was_read(each) for each in tmp_path.glob("img00*"))


@pytest.mark.parametrize("name", ["http://{}/a.mp4", "tcp://{}", "pipe:0"])
@pytest.mark.parametrize("open_path", [open_video, fingerprint])
def test_a_path_is_no_address(name, open_path, server):
    with pytest.raises(VideoError):
        open_path(Path(name.format(server.address)))
    assert server.callers == []


@pytest.mark.parametrize("name", ["concat:a.mp4", "concat:a.mp4|b.mp4", "file:a.mp4", "subfile,,a"])
def test_names_that_ffmpeg_would_read_as_more(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_video(tmp_path / "a.mp4", count=9)
    write_video(tmp_path / name, container_format="mp4", count=5)
    with open_video(Path(name)) as source:
        assert [read_index(frame.image) for frame in source] == list(range(5))


@pytest.mark.parametrize("open_path", [open_video, probe_video, open_container, fingerprint])
def test_whoever_opens_a_pipe_is_not_kept_waiting(open_path, tmp_path):
    os.mkfifo(tmp_path / "a.mp4")
    with pytest.raises(VideoFormatError, match="a pipe, a socket or a device"):
        open_path(tmp_path / "a.mp4")


def test_devices_have_no_end(tmp_path):
    (tmp_path / "a.mp4").symlink_to("/dev/zero")
    with pytest.raises(VideoFormatError, match="a device"):
        fingerprint(tmp_path / "a.mp4")


def test_what_others_set_for_opencv_is_left_to_them(tmp_path, monkeypatch):
    path = write_video(tmp_path / "a.mp4", count=5)
    monkeypatch.setenv("OPENCV_FFMPEG_CAPTURE_OPTIONS", "rtsp_transport;udp")
    open_video(path).close()
    assert os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"] == "rtsp_transport;udp"
    monkeypatch.delenv("OPENCV_FFMPEG_CAPTURE_OPTIONS")
    open_video(path).close()
    assert "OPENCV_FFMPEG_CAPTURE_OPTIONS" not in os.environ
