"""Labels and ids that would be markup, formulas, paths or commands elsewhere are words here."""

import csv
import json
import zipfile
from xml.etree import ElementTree

import pytest
import yaml
from support.labelled import labelled_track, labelled_video

from situp_annotate.formats.class_labels import is_label
from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.exporting import EXPORTERS
from situp_annotate.formats.manifest.ids import is_safe_id
from situp_annotate.formats.xml_text import xml_text
from situp_annotate.types import BoundingBox

LABELS = [
    *("</script><script>alert(1)</script>", '"><img src=x onerror=alert(1)>', "' onload='alert(1)"),
    *("]]>", "&lt;&amp;&#0;", "<!--", "{{ 7 * 7 }}", "%s%n", "$(touch x)", "`touch x`", "; rm -rf"),
    *("..", "../../up", "/etc/absolute", "C:\\drive", "CON", ".", "-rf", "javascript:alert(1)"),
    *("=cmd|' /C calc'!A0", "+1+1", "-1+1", "@SUM(1)", "a,b", 'a"b', "a;b", "a: b", "- a", "#a"),
    *("null", "true", "1e3", "[a]", "{a}", "!!python/object:os.system", "&anchor", "*alias", "|"),
    *("\u202egnp.exe", "\u2066a", "\ufeffa", "a\uffff", "a\ufffe", "\U0001f600", "名前"),
    "x" * 10_000,
]  # fmt: skip
IDS = [
    *("<script>", "a&b", "'quoted'", '"quoted"', "$(touch x)", "`touch x`", "-rf", "CON", "a..b"),
    *("%2e%2e%2fup", "=1+1", "a b", "~", "javascript:alert(1)", "{{ 7 * 7 }}", "\u202egnp", "名前"),
    *("a: b", "data.yaml", "coco.json", "labels", "x" * 100),
]  # fmt: skip


@pytest.fixture(params=EXPORTERS)
def name(request):
    return request.param


@pytest.fixture(scope="module")
def videos():
    """The first has all the labels."""
    boxes = {frame: BoundingBox(10, 20, 30, 40) for frame in range(3)}
    tracks = [
        labelled_track(number, boxes, label, {label: label})
        for number, label in enumerate(LABELS, start=1)
    ]
    return [
        labelled_video(*tracks[: len(tracks) if video_id == IDS[0] else 1], video_id=video_id,
                       frame_count=3)
        for video_id in IDS
    ]  # fmt: skip


@pytest.fixture
def folder(tmp_path, name, videos):
    """What is written, in a folder beside which nothing else may be."""
    folder = tmp_path / "inner" / "out"
    folder.mkdir(parents=True)
    EXPORTERS[name](iter(videos), folder, ExportOptions())
    assert [each.name for each in tmp_path.iterdir()] == ["inner"]
    assert [each.name for each in (tmp_path / "inner").iterdir()] == ["out"]
    return folder


def test_the_names_are_such_as_a_manifest_may_hold():
    assert all(map(is_label, LABELS))
    assert all(map(is_safe_id, IDS))


@pytest.mark.parametrize(
    "video_id", ["", ".", "..", "a/b", "/a", "a\\b", "a\0b", ".hidden", "a\nb", " a", "Batch.JSON"]
)
def test_ids_that_lead_elsewhere_are_not(video_id):
    assert not is_safe_id(video_id)


@pytest.mark.parametrize(
    "label", ["", " ", "a\tb", "a\nb", "a\0b", "a\u2028b", "a\x85b", "a\ud800"]
)
def test_labels_of_several_lines_or_none_are_not(label):
    assert not is_label(label)


def test_every_file_has_a_place_of_its_own_inside(name, folder):
    files = [path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()]
    owned = {
        "cvat": {f"{video_id}.xml" for video_id in IDS},
        "cvat-mot": {f"{video_id}.zip" for video_id in IDS},
        "mot": {f"{video_id}.txt" for video_id in IDS},
        "mot-gt": {
            f"{video_id}/{file}"
            for video_id in IDS
            for file in ("gt/gt.txt", "gt/labels.txt", "seqinfo.ini")
        },
        "label-studio": {"label_studio.json", "label_config.xml"},
        "coco": {"coco.json"},
        "yolo": {
            "data.yaml",
            *(
                f"{kind}/{video_id}/{frame:06d}.txt"
                for kind in ("labels", "tracks")
                for video_id in IDS
                for frame in range(3)
            ),
        },
        "csv": {"labels.csv"},
    }
    assert set(files) == owned[name]


def written(videos, name, folder):
    EXPORTERS[name](iter(videos), folder, ExportOptions())
    return folder


def test_xml_holds_them_as_text(tmp_path, videos):
    written(videos, "cvat", tmp_path)
    roots = [ElementTree.parse(tmp_path / f"{video_id}.xml").getroot() for video_id in IDS]
    assert [root.findtext("meta/task/name") for root in roots] == IDS
    assert [each.get("label") for each in roots[0].iter("track")] == list(map(xml_text, LABELS))


def test_label_studio_s_interface_holds_them_as_text(tmp_path, videos):
    written(videos, "label-studio", tmp_path)
    root = ElementTree.parse(tmp_path / "label_config.xml").getroot()
    assert {each.get("value") for each in root.iter("Label")} == set(map(xml_text, LABELS))
    assert {each.tag for each in root.iter()} == {
        "View", "Video", "VideoRectangle", "Labels", "Label"
    }  # fmt: skip
    tasks = json.loads((tmp_path / "label_studio.json").read_text())
    assert [task["data"]["situp_id"] for task in tasks] == IDS


def test_yaml_holds_them_as_text(tmp_path, videos):
    config = yaml.safe_load((written(videos, "yolo", tmp_path) / "data.yaml").read_text())
    assert list(config["names"].values()) == LABELS
    assert config["train"] == [f"images/{video_id}" for video_id in IDS]


def test_coco_holds_them_as_text(tmp_path, videos):
    document = json.loads((written(videos, "coco", tmp_path) / "coco.json").read_text())
    assert [entry["name"] for entry in document["categories"]] == LABELS
    assert [entry["name"] for entry in document["videos"]] == IDS


def test_tables_hold_them_as_they_are(tmp_path, videos):
    """A leading = is not disguised: these are data for programs, which would take the disguise."""
    with (written(videos, "csv", tmp_path) / "labels.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(dict.fromkeys(row["label"] for row in rows)) == LABELS
    assert list(dict.fromkeys(row["video"] for row in rows)) == IDS


def test_lists_of_classes_have_a_line_for_each(tmp_path, videos):
    written(videos, "cvat-mot", tmp_path)
    with zipfile.ZipFile(tmp_path / f"{IDS[0]}.zip") as archive:
        assert archive.namelist() == ["gt/gt.txt", "gt/labels.txt"]
        lines = archive.read("gt/labels.txt").decode().split("\n")
    assert lines == [*LABELS, ""]
