"""Finding videos below a folder, and hashing them."""

import hashlib
import os
from pathlib import Path

import pytest
from support.media import write_image_folder

from situp_annotate.errors import VideoFormatError, VideoMissingError
from situp_annotate.video import find_videos, fingerprint


def names(folder: Path) -> list[str]:
    return [path.relative_to(folder).as_posix() for path in find_videos(folder)]


def touch(path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"")


def test_files_and_folders_in_natural_order(tmp_path: Path) -> None:
    for name in ("10.mp4", "2.MP4", "b/1.avi", "a/clip12.mkv", "a/clip3.mkv", "a/deep/x.ts"):
        touch(tmp_path / name)
    for name in ("notes.txt", "._2.mp4", ".hidden/1.mp4", "sound.wav"):
        touch(tmp_path / name)
    write_image_folder(tmp_path / "seq", count=2)
    write_image_folder(tmp_path / "seq" / "masks", count=2)
    write_image_folder(tmp_path / "otb" / "Dog" / "img", count=2)
    assert names(tmp_path) == [
        "2.MP4",
        "10.mp4",
        "a/clip3.mkv",
        "a/clip12.mkv",
        "a/deep/x.ts",
        "b/1.avi",
        "otb/Dog",
        "seq",
    ]


def test_pictures_beside_videos_are_no_source(tmp_path: Path) -> None:
    touch(tmp_path / "1.mp4")
    write_image_folder(tmp_path, count=2)
    assert names(tmp_path) == ["1.mp4"]


def test_the_folder_itself_can_be_the_video(tmp_path: Path) -> None:
    assert find_videos(tmp_path) == []
    write_image_folder(tmp_path / "img", count=2)
    assert find_videos(tmp_path) == [tmp_path]


def test_a_loop_of_links_ends(tmp_path: Path) -> None:
    touch(tmp_path / "a" / "1.mp4")
    (tmp_path / "a" / "again").symlink_to(tmp_path, target_is_directory=True)
    assert names(tmp_path) == ["a/1.mp4"]


def test_no_folder(tmp_path: Path) -> None:
    with pytest.raises(VideoMissingError, match="gone"):
        find_videos(tmp_path / "gone")
    touch(tmp_path / "1.mp4")
    with pytest.raises(VideoFormatError, match="a file"):
        find_videos(tmp_path / "1.mp4")


def test_fingerprint_of_a_file(tmp_path: Path) -> None:
    (tmp_path / "a.mp4").write_bytes(b"content")
    assert fingerprint(tmp_path / "a.mp4") == hashlib.sha256(b"content").hexdigest()


def test_fingerprint_of_a_folder_sees_names_and_contents(tmp_path: Path) -> None:
    one = fingerprint(write_image_folder(tmp_path / "one", count=3))
    assert one == fingerprint(write_image_folder(tmp_path / "two", count=3))
    (tmp_path / "two" / "notes.txt").write_text("no picture")
    assert one == fingerprint(tmp_path / "two")
    (tmp_path / "two" / "3.png").rename(tmp_path / "two" / "4.png")
    renamed = fingerprint(tmp_path / "two")
    (tmp_path / "two" / "4.png").write_bytes(b"other")
    assert len({one, renamed, fingerprint(tmp_path / "two")}) == 3


def test_fingerprint_of_a_folder_with_what_is_no_file(tmp_path: Path) -> None:
    whole = fingerprint(write_image_folder(tmp_path / "seq", count=3))
    (tmp_path / "seq" / "2.png").unlink()
    os.mkfifo(tmp_path / "seq" / "2.png")
    pipe = fingerprint(tmp_path / "seq")
    (tmp_path / "seq" / "2.png").unlink()
    assert len({whole, pipe, fingerprint(tmp_path / "seq")}) == 3


def test_fingerprint_of_names_that_are_no_text(tmp_path: Path) -> None:
    write_image_folder(tmp_path, count=1)
    try:
        (tmp_path / os.fsdecode(b"\xff.png")).write_bytes(b"")
    except OSError:
        pytest.skip("this file system has no such names")
    assert len(fingerprint(tmp_path)) == 64


def test_fingerprint_of_nothing(tmp_path: Path) -> None:
    with pytest.raises(VideoMissingError, match="gone"):
        fingerprint(tmp_path / "gone.mp4")
    with pytest.raises(VideoFormatError, match="no pictures"):
        fingerprint(tmp_path)
