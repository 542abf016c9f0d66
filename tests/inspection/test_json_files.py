"""JSON: manifests, results of runs, Label Studio, COCO."""

import copy
import json

import pytest
from support.media import write_video

from situp_annotate.inspection import Grade, inspect_path

MANIFEST = {
    "version": 1,
    "videos": [
        {"path": "a.mp4", "tracks": [{"id": 1, "label": "car", "frame": 0, "box": [1, 2, 3, 4]}]}
    ],
}
ITEM = {"frame": 1, "time": 0.04, "x": 1, "y": 2, "width": 3, "height": 4, "enabled": True}
REGION = {
    "id": "r",
    "type": "videorectangle",
    "value": {"labels": ["car"], "framesCount": 50, "duration": 2.0, "sequence": [ITEM]},
}
COCO = {
    "videos": [{"id": 1, "name": "a"}],
    "images": [{"id": 7, "video_id": 1, "frame_index": 0, "width": 64, "height": 48}],
    "tracks": [{"id": 1, "category_id": 1, "video_id": 1}],
    "annotations": [
        {"id": 1, "image_id": 7, "track_id": 1, "category_id": 1, "bbox": [1, 2, 3, 4], "area": 12}
    ],
    "categories": [{"id": 1, "name": "car"}],
}
BATCH = {
    "succeeded": 1,
    "failed": 1,
    "interrupted": False,
    "started_at": "2026-01-01",
    "recipe": {},
    "videos": [
        {"status": "ok", "id": "a", "frames": 10},
        {"status": "failed", "id": "b", "kind": "missing", "message": "b.mp4 is not there."},
    ],
}


def inspect_document(folder, document, name="file.json"):
    path = folder / name
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    return inspect_path(path)


def kinds(report):
    return {remark.kind for remark in report.remarks}


def with_change(document, *place, value):
    changed = copy.deepcopy(document)
    inner = changed
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    return changed


# ---- manifests and results -----------------------------------------------------------------


def test_manifest(tmp_path):
    report = inspect_document(tmp_path, MANIFEST)
    assert (report.kind, kinds(report), report.grade) == ("manifest", {"missing"}, Grade.PROBLEM)
    write_video(tmp_path / "a.mp4", count=2)
    report = inspect_document(tmp_path, MANIFEST)
    assert (report.title, report.remarks) == ("manifest, 1 video, 1 track", ())


def test_manifest_s_problems_are_listed_with_their_places(tmp_path):
    report = inspect_document(tmp_path, with_change(MANIFEST, "videos", 0, "path", value=7))
    assert report.grade is Grade.PROBLEM
    assert report.remarks[0].message.startswith("$.videos[0].path: ")


def test_manifest_without_tracks_or_outside_of_its_folder(tmp_path):
    (tmp_path / "inner").mkdir()
    write_video(tmp_path / "a.mp4", count=2)
    document = {"version": 1, "videos": [{"path": "../a.mp4", "tracks": []}]}
    assert kinds(inspect_document(tmp_path / "inner", document)) == {"no_tracks", "outside"}


def test_a_run_s_outcome(tmp_path):
    report = inspect_document(tmp_path, BATCH)
    assert (report.kind, kinds(report), report.grade) == ("batch", {"missing"}, Grade.PROBLEM)
    assert report.remarks[0].message == "b failed: b.mp4 is not there."
    inspect_document(tmp_path, BATCH | {"interrupted": True}, "batch.json")
    folder = inspect_path(tmp_path)
    assert (folder.kind, kinds(folder)) == ("run", {"missing", "interrupted", "gone"})
    (interrupted,) = (each for each in folder.remarks if each.kind == "interrupted")
    assert "--overwrite" in interrupted.message  # a run refuses a folder that is there
    inspect_document(tmp_path, "{}", "batch.json")
    assert kinds(inspect_path(tmp_path)) == {"batch"}


def test_a_video_s_outcome(tmp_path):
    document = {
        "status": "ok",
        "id": "a",
        "video": {},
        "tracks": [1],
        "outputs": [],
        "frames": 3,
        "findings": [{"kind": "gap", "message": "A gap."}],
    }
    report = inspect_document(tmp_path, document)
    assert (report.kind, kinds(report), report.grade) == ("summary", {"gap"}, Grade.NOTE)


# ---- Label Studio --------------------------------------------------------------------------


def tasks(*regions):
    return [{"id": 1, "data": {"video": "a.mp4"}, "annotations": [{"result": list(regions)}]}]


def test_label_studio(tmp_path):
    report = inspect_document(tmp_path, tasks(REGION))
    assert (report.kind, kinds(report)) == ("label_studio", {"frames_by_time"})
    assert report.grade is Grade.NOTE
    facts = dict(report.facts)
    assert (facts["labels"], facts["frame rate"]) == ("car: 1", "25")


@pytest.mark.parametrize(
    ("place", "value", "kind"),
    [
        (("value", "sequence", 0, "time"), 1.5, "time"),
        (("value", "sequence", 0, "frame"), 0, "frame_0"),
        (("value", "sequence", 0, "width"), 320, "percent"),
        (("value", "sequence", 0, "rotation"), 12, "rotation"),
        (("value", "sequence", 0, "x"), "left", "not_a_box"),
        (("value", "sequence"), [], "no_sequence"),
    ],
)
def test_what_bites_in_label_studio(tmp_path, place, value, kind):
    report = inspect_document(tmp_path, tasks(with_change(REGION, *place, value=value)))
    assert kinds(report) - {"frames_by_time"} == {kind}


def test_label_studio_without_rate_or_boxes(tmp_path):
    region = with_change(REGION, "value", "duration", value=None)
    assert kinds(inspect_document(tmp_path, tasks(region))) == {"no_rate"}
    assert kinds(inspect_document(tmp_path, tasks())) == {"empty"}
    report = inspect_document(tmp_path, tasks({"type": "choices"}))
    assert (kinds(report), report.grade) == ({"types"}, Grade.PROBLEM)


# ---- COCO ----------------------------------------------------------------------------------


def test_coco_video(tmp_path):
    report = inspect_document(tmp_path, COCO)
    assert (report.kind, report.remarks) == ("coco_video", ())
    assert dict(report.facts)["classes"] == "car: 1"


@pytest.mark.parametrize(
    ("place", "value", "kind"),
    [
        (("annotations", 0, "bbox"), [1, 2, 3], "not_a_box"),
        (("annotations", 0, "bbox"), [1, 2, 0, 4], "not_a_box"),
        (("annotations", 0, "bbox"), [10**400, 2, -(10**400), 4], "not_a_box"),
        (("annotations", 0, "image_id"), 8, "no_image"),
        (("annotations", 0, "category_id"), [], "no_category"),
        (("annotations", 0, "track_id"), None, "no_track"),
        (("images", 0, "video_id"), 2, "no_video"),
        (("images", 0, "video_id"), [], "no_video"),
        (("images", 0, "frame_index"), None, "no_frame"),
        (("images", 0, "frame_index"), 1, "frames_from_1"),
        (("annotations",), COCO["annotations"] * 2, "double"),
        (("annotations",), [], "empty"),
    ],
)
def test_what_bites_in_coco(tmp_path, place, value, kind):
    assert kinds(inspect_document(tmp_path, with_change(COCO, *place, value=value))) == {kind}


def test_other_cocos(tmp_path):
    pictures = {
        "images": [{"id": 1}],
        "annotations": COCO["annotations"],
        "categories": COCO["categories"],
    }
    assert kinds(inspect_document(tmp_path, pictures)) == {"no_videos"}
    whole_tracks = COCO | {"annotations": [{"bboxes": [[1, 2, 3, 4], None]}]}
    assert kinds(inspect_document(tmp_path, whole_tracks)) == {"youtube_vis"}


# ---- anything else -------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        '{"a": 1',
        '{"a": 1}\n{"a": 2}\n',
        "[" * 100_000,
        '{"a": ' + "9" * 5000 + "}",
        '[{"data": {}, "id": ' + "[" * 950 + "]" * 950 + "}]",
    ],
)
def test_no_json(tmp_path, text):
    report = inspect_document(tmp_path, text)
    assert (report.kind, report.grade) == ("json", Grade.PROBLEM)


@pytest.mark.parametrize("text", ["{}", "[]", '{"a": 1}', "[1, 2]", '["x"]'])
def test_json_of_another_kind(tmp_path, text):
    report = inspect_document(tmp_path, text)
    assert (report.kind, report.grade) == ("unknown", Grade.PROBLEM)


def test_what_is_shown_of_a_run_s_outcome_is_short(tmp_path):
    long = "x" * 100_000
    failure = {"status": "failed", "id": long, "kind": long, "message": long}
    good = {"status": "ok", "id": "../" + long, "frames": 10**4000}
    batch = BATCH | {"started_at": long, "videos": [failure, good, good, {"status": long}]}
    inspect_document(tmp_path, batch, "batch.json")
    for path in (tmp_path, tmp_path / "batch.json"):
        report = inspect_path(path)
        assert report.grade is Grade.PROBLEM
        assert len(json.dumps(report.as_dict())) < 20_000


def test_a_path_that_is_too_long_is_not_there(tmp_path):
    video = {"path": "x" * 300, "tracks": []}
    report = inspect_document(tmp_path, MANIFEST | {"videos": [video]})
    assert kinds(report) == {"missing", "no_tracks"}
