"""Label files find their videos and their formats."""

import os

import pytest

from situp_annotate.errors import SitupError
from situp_annotate.seeding import VideoFinder, read_class_names, recognize


@pytest.fixture
def folder(tmp_path):
    for name in ("street.mp4", "night/street.avi", "door.mp4"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.touch()
    pictures = tmp_path / "Crossing" / "img"
    pictures.mkdir(parents=True)
    (pictures / "0001.jpg").touch()
    return tmp_path


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("door.mp4", "door.mp4"),
        ("door", "door.mp4"),
        ("uploads\\4f\\door.mp4", "door.mp4"),
        ("/data/local-files/door.mp4", "door.mp4"),
        ("street.avi", "night/street.avi"),
        ("Crossing", "Crossing"),
        ("", "door.mp4"),
    ],
)
def test_a_video_is_found_by_its_name(folder, name, found):
    finder = VideoFinder([folder])
    assert finder.find(name, folder / "door.xml") == folder / found


def test_names_that_several_videos_have_are_refused(folder):
    with pytest.raises(SitupError, match=r"may be .*--videos"):
        VideoFinder([folder]).find("street", folder / "a.xml")
    finder = VideoFinder([folder / "street.mp4", folder / "door.mp4"])
    assert finder.find("street", folder / "a.xml") == folder / "street.mp4"


def test_a_runs_ids_name_its_videos(folder):
    ids = {"day": folder / "street.mp4", "night": folder / "night" / "street.avi"}
    finder = VideoFinder([], ids)
    assert finder.find("", folder / "night.txt") == ids["night"]
    assert finder.find("street.avi", folder / "a.xml") == ids["night"]
    assert finder.find("street", folder / "day.xml") == ids["day"]
    assert finder.find("anything", folder / "a.json", "night") == ids["night"]
    assert finder.find("renamed in the tool", folder / "day.xml") == ids["day"]
    with pytest.raises(SitupError, match=r"may be .* by the id of the video"):
        finder.find("street", folder / "a.xml")
    with pytest.raises(SitupError, match="videos here: day, night"):
        finder.find("", folder / "a.xml")


def test_a_name_that_is_another_videos_id_does_not_mislead(folder):
    (folder / "cam").mkdir()
    (folder / "cam" / "door.mp4").touch()
    ids = {"door": folder / "door.mp4", "cam-door": folder / "cam" / "door.mp4"}
    finder = VideoFinder([], ids)
    assert finder.find("door.mp4", folder / "cam-door.xml") == ids["cam-door"]
    assert finder.find("door.mp4", folder / "door.xml") == ids["door"]


def test_the_only_video_there_is_needs_no_name(folder):
    finder = VideoFinder([folder / "door.mp4"])
    assert finder.find("task 12", folder / "a.xml") == folder / "door.mp4"
    with pytest.raises(SitupError, match=r"no video named 'task 12'.*videos here: "):
        VideoFinder([folder]).find("task 12", folder / "a.xml")
    with pytest.raises(SitupError, match="videos here: none"):
        VideoFinder([]).find("task 12", folder / "a.xml")


def test_class_names_count_from_one(tmp_path):
    path = tmp_path / "labels.txt"
    path.write_text("person\n\ncar\n")
    assert read_class_names(path) == {1: "person", 3: "car"}
    with pytest.raises(SitupError, match=r"none\.txt"):
        read_class_names(tmp_path / "none.txt")


def test_files_of_no_known_format_are_refused(tmp_path):
    path = tmp_path / "thing.bin"
    path.write_bytes(b"\x00\x01\x02")
    with pytest.raises(SitupError, match=r"thing\.bin: this is none of the formats"):
        recognize(path)
    with pytest.raises(SitupError, match="cannot be read"):
        recognize(tmp_path)


def test_a_pipe_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for read in (recognize, read_class_names):
        with pytest.raises(SitupError, match="pipe: this is a pipe"):
            read(tmp_path / "pipe")


def test_class_names_may_begin_with_a_byte_order_mark(tmp_path):
    path = tmp_path / "names.txt"
    path.write_bytes(b"\xef\xbb\xbfcar\r\n\r\ndog\r\n")
    assert read_class_names(path) == {1: "car", 3: "dog"}


def test_a_long_name_is_shortened_in_the_message(folder):
    with pytest.raises(SitupError, match="no video named") as caught:
        VideoFinder([folder]).find("x" * 100_000, folder / "a.xml")
    assert len(str(caught.value)) < 2000
