"""Whatever stands at a path is told apart, and nothing makes inspecting fail."""

import json
import os
import socket

import cv2
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from support.media import draw_index, write_image_folder, write_video

from situp_annotate.inspection import FileReport, Grade, Remark, inspect_path
from situp_annotate.recipe import load_recipe


def inspect_content(folder, content, name="file"):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return inspect_path(path)


def kinds(report):
    return {remark.kind for remark in report.remarks}


# ---- values --------------------------------------------------------------------------------


def test_the_worst_remark_comes_first_and_grades_the_file(tmp_path):
    remarks = tuple(Remark(grade, grade.value, "…") for grade in (Grade.NOTE, *Grade, Grade.NOTE))
    report = FileReport(tmp_path, "video", "a video", remarks=remarks)
    shown = [remark.kind for remark in report.remarks]
    assert shown == ["problem", "warning", "note", "note", "note", "fine"]
    assert report.grade is Grade.PROBLEM
    assert FileReport(tmp_path, "video", "a video").grade is Grade.FINE


# ---- what stands there ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "kind", "word"),
    [
        (b"", "empty", "an empty file"),
        (b"\x89PNG\r\n\x1a\n" + bytes(99), "picture", "a single picture"),
        (b"\xff\xd8\xff\xe0" + bytes(99), "picture", "a single picture"),
        (b"RIFF\1\2\3\4WEBPVP8 " + bytes(99), "picture", "a single picture"),
        ("1,2,3,4".encode("utf-16"), "unknown", "UTF-16"),
        (b"\x1f\x8b\x08" + bytes(99), "unknown", "gzip"),
        (b"%PDF-1.7\n\0\1\2", "unknown", "a PDF"),
        (b"\0\1\2\3" * 99, "unknown", "a binary file"),
        (b"\0\0\0\x20ftypisom" + bytes(99), "unknown", "an MP4"),
        ("0 0.5 0.5 0.1 0.1\n", "yolo", "YOLO"),
        ("Dear diary,\nnothing.", "unknown", "a text file of an unknown kind"),
        ("\n \n", "unknown", "a text file without text"),
        ("#EXTM3U\nhttp://example.org/a.ts\n", "unknown", "a text file of an unknown kind"),
        ("PK\3\4 but no archive", "zip", "a zip archive, not readable"),
        ("frame,time_s,track_id,label\n1,2,3,4\n", "labels_csv", "labels.csv), 1 row"),
        ("rank,track_id,label,frame\n", "review_csv", "review.csv), 0 rows"),
    ],
)
def test_kinds_of_files(tmp_path, content, kind, word):
    report = inspect_content(tmp_path, content)
    assert report.kind == kind
    assert word in report.title
    assert (report.grade is Grade.FINE) == kind.endswith("_csv")


@pytest.mark.parametrize(
    ("name", "codec", "pixel_format"),
    [("a.mjpeg", "mjpeg", "yuvj420p"), ("a.apng", "apng", "rgb24")],
)
def test_videos_that_begin_as_a_picture_does(tmp_path, name, codec, pixel_format):
    # Some pictures more than FFmpeg must see to tell a stream from a picture.
    path = write_video(tmp_path / name, count=30, codec=codec, pixel_format=pixel_format)
    report = inspect_path(path)
    assert report.kind == "video"
    assert "30 frames" in report.title


def test_one_picture_is_no_video(tmp_path):
    for suffix in (".jpg", ".png", ".webp", ".tif"):
        path = tmp_path / f"a{suffix}"
        assert cv2.imwrite(str(path), draw_index(1, (240, 320)))
        assert inspect_path(path).kind == "picture"
        assert inspect_path(path.rename(tmp_path / "a")).kind == "picture"


def test_what_is_no_file(tmp_path, monkeypatch):
    assert kinds(inspect_path(tmp_path / "none")) == {"missing"}
    assert kinds(inspect_path(tmp_path / "nul\0l")) == {"missing"}
    os.mkfifo(tmp_path / "pipe")
    assert inspect_path(tmp_path / "pipe").kind == "special"
    with socket.socket(socket.AF_UNIX) as plug:
        monkeypatch.chdir(tmp_path)  # a socket's path must be short
        plug.bind("plug")
        assert inspect_path(tmp_path / "plug").kind == "special"
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    assert kinds(inspect_path(tmp_path / "loop")) == {"missing"}


def test_a_file_that_may_not_be_read(tmp_path, monkeypatch):
    path = tmp_path / "a.txt"
    path.write_text("1,2,3,4")

    def refuse(*arguments, **options):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.open", refuse)
    report = inspect_path(path)
    assert kinds(report) == {"missing"}
    assert "Permission denied" in report.remarks[0].message


# ---- recipes -------------------------------------------------------------------------------


def test_recipes(tmp_path):
    report = inspect_content(tmp_path, "[outputs]\nmcap = false\n", "a.toml")
    assert (report.title, report.remarks) == ("recipe, 1 setting", ())
    report = inspect_content(tmp_path, "# mine\n[tracker]\nlerning_rate = 1\n", "a.toml")
    assert (report.kind, kinds(report)) == ("recipe", {"recipe"})
    assert "learning_rate" in report.remarks[0].message
    assert str(tmp_path) not in report.remarks[0].message
    assert kinds(inspect_content(tmp_path, "[outputs\n", "a.toml")) == {"toml"}
    assert inspect_content(tmp_path, "[project]\na = 1\n", "a.toml").kind == "unknown"
    assert inspect_content(tmp_path, "# " + "x" * 2**20, "a.toml").kind == "unknown"
    assert inspect_content(tmp_path, "# only the defaults\n", "a.toml").grade is Grade.FINE
    load_recipe(tmp_path / "a.toml")


# ---- folders -------------------------------------------------------------------------------


def test_a_folder_of_pictures(tmp_path):
    report = inspect_path(write_image_folder(tmp_path / "a", digits=3))
    assert (report.kind, report.title, report.remarks) == ("images", "12 pictures", ())
    facts = dict(report.facts)
    assert facts["pictures"] == "001.png to 012.png, in natural order"
    assert (facts["size"], facts["decoded"]) == ("64 × 48", "12 of 12")


def test_otb_s_layout_and_its_true_boxes(tmp_path):
    write_image_folder(tmp_path / "a" / "img", digits=3, count=3)
    truth = tmp_path / "a" / "groundtruth_rect.txt"
    truth.write_text("1,2,3,4\n" * 3)
    report = inspect_path(tmp_path / "a")
    assert (report.title, report.remarks) == ("3 pictures, in OTB’s layout", ())
    assert dict(report.facts)["true boxes"] == "groundtruth_rect.txt"
    assert inspect_path(truth).remarks == ()
    truth.write_text("1,2,3,4\n" * 2)
    assert kinds(inspect_path(truth)) == {"frame_count"}


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        (lambda folder: (folder / "012.png").rename(folder / "12.png"), set()),
        (lambda folder: (folder / "010.png").rename(folder / "10.png"), {"order"}),
        (lambda folder: (folder / "005.png").unlink(), {"numbering"}),
        (lambda folder: (folder / "005.png").rename(folder / "005.bmp"), {"suffixes"}),
        (lambda folder: (folder / "005.png").write_bytes(b"x"), {"incomplete"}),
        (lambda folder: (folder / "001.png").write_bytes(b"x"), {"incomplete"}),
    ],
)
def test_what_bites_in_a_folder_of_pictures(tmp_path, change, kind):
    folder = write_image_folder(tmp_path / "a", digits=3)
    change(folder)
    assert kinds(inspect_path(folder)) == kind


def test_a_picture_of_another_size(tmp_path):
    folder = write_image_folder(tmp_path / "a", digits=3)
    cv2.imwrite(str(folder / "005.png"), draw_index(4, (50, 64)))
    assert kinds(inspect_path(folder)) == {"frame_size"}
    assert inspect_path(folder, quick=True).remarks == ()


def test_other_folders(tmp_path):
    (tmp_path / "a").mkdir()
    assert inspect_path(tmp_path / "a").grade is Grade.PROBLEM
    (tmp_path / "a" / "notes.txt").write_text("x")
    assert inspect_path(tmp_path / "a").grade is Grade.PROBLEM
    write_video(tmp_path / "a" / "b.mp4", count=2)
    write_image_folder(tmp_path / "a", count=1)
    report = inspect_path(tmp_path / "a")
    assert (report.title, report.grade) == ("a folder with 1 video", Grade.NOTE)
    (tmp_path / "a" / "summary.json").write_text("{}")
    assert inspect_path(tmp_path / "a").title == "results of one video"


# ---- anything at all -----------------------------------------------------------------------


@given(st.binary(max_size=3000))
@example(b"[" * 3000)
@example(b"{" + b"1" * 2999)
@example(b"<" * 3000)
@example(b"PK\5\6" + bytes(18))
@example(b"1,1,1e999,1,1,1,1\n")
@example(b"1,1,1,1,1,1,1,1e300,1\n1e300,1,1,1,1,1,1,1,1")
@settings(max_examples=150, deadline=None)
def test_any_bytes_are_answered(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("any") / "file"
    path.write_bytes(content)
    report = inspect_path(path)
    assert report.title
    assert all(remark.message for remark in report.remarks)


LINES = st.text(alphabet="0123456789-+.eE,; \tnaNif\n\r\ufeff", max_size=300)


@given(LINES)
@settings(max_examples=200, deadline=None)
def test_any_rows_are_answered(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("rows") / "file.txt"
    path.write_text(text, encoding="utf-8", newline="")
    assert inspect_path(path).title


JSON_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(
                [
                    "videos",
                    "images",
                    "annotations",
                    "categories",
                    "id",
                    "bbox",
                    "data",
                    "predictions",
                ]
                + ["result", "type", "value", "sequence", "frame", "status", "video", "tracks"]
                + ["outputs", "succeeded", "failed", "recipe", "bboxes", "track_id", "findings"]
            ),
            inner | st.just("videorectangle"),
            max_size=6,
        )
    ),
    max_leaves=40,
)


@given(JSON_VALUES)
@settings(max_examples=300, deadline=None)
def test_any_json_is_answered(tmp_path_factory, document):
    path = tmp_path_factory.mktemp("json") / "file.json"
    path.write_text(json.dumps(document))
    assert inspect_path(path).title


VIDEOS = ("a.mp4", "a.ts", "a.avi", "a.webm", "a.h264")


@pytest.fixture(scope="module")
def sound_videos(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sound")
    for name in VIDEOS:
        write_video(folder / name, count=20)
    return folder


@given(
    name=st.sampled_from(VIDEOS),
    spots=st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), max_size=20),
    share=st.floats(0.2, 1),
)
@settings(max_examples=60, deadline=None)
def test_any_damaged_video_is_answered(tmp_path_factory, sound_videos, name, spots, share):
    content = bytearray((sound_videos / name).read_bytes())
    del content[int(share * len(content)) :]
    for place, value in spots:
        content[int(place * (len(content) - 1))] = value
    path = tmp_path_factory.mktemp("damaged") / "file"
    path.write_bytes(content)
    for quick in (False, True):
        report = inspect_path(path, quick=quick)
        assert report.title
        assert all(remark.message for remark in report.remarks)
