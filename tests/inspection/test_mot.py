"""MOT text, alone, in a folder and in the archive that CVAT takes."""

import zipfile

import pytest

from situp_annotate.inspection import Grade, inspect_path

RESULT = "1,1,10,20,30,40,0.9,-1,-1,-1\n2,1,11,20,30,40,0.8,-1,-1,-1\n2,2,5,5,9,9,1,-1,-1,-1\n"
GT = "1,1,10,20,30,40,1,1,1\n2,1,11,20,30,40,1,1,0.5\n"
DET = "1,-1,10,20,30,40,27.5\n1,-1,90,20,30,40,12\n"
SEQINFO = """\
[Sequence]
name=a
imDir=img1
frameRate=30
seqLength=2
imWidth=64
imHeight=48
imExt=.jpg
"""


def inspect_text(folder, text, name="rows.txt"):
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return inspect_path(path)


def kinds(report):
    return {remark.kind for remark in report.remarks}


@pytest.mark.parametrize(
    ("text", "title", "expected"),
    [
        (RESULT, "MOT tracking results, 3 rows", set()),
        (RESULT.replace("\n", "\r\n"), "MOT tracking results, 3 rows", set()),
        (GT, "MOT ground truth, 2 rows", set()),
        (DET, "MOT detections, 2 rows", {"det"}),
        ("1,1,1,1,5,5,1\n", "MOT tracking results, 1 row", set()),
    ],
)
def test_sound_files(tmp_path, text, title, expected):
    report = inspect_text(tmp_path, text)
    assert (report.kind, report.title, kinds(report)) == ("mot", title, expected)
    assert report.grade in {Grade.FINE, Grade.NOTE}


@pytest.mark.parametrize(
    ("row", "kind", "grade"),
    [
        ("0,3,1,1,5,5,1,-1,-1,-1", "frame_0", Grade.PROBLEM),
        ("-2,3,1,1,5,5,1,-1,-1,-1", "negative_frame", Grade.PROBLEM),
        ("2,2,1,1,5,5,1,-1,-1,-1", "double", Grade.PROBLEM),
        ("3,3,1,1,0,5,1,-1,-1,-1", "empty_box", Grade.PROBLEM),
        ("3,3,1,1,nan,5,1,-1,-1,-1", "not_a_number", Grade.PROBLEM),
        ("3,3,1,1,five,5,1,-1,-1,-1", "not_a_number", Grade.PROBLEM),
        ("3,3.5,1,1,5,5,1,-1,-1,-1", "fraction", Grade.PROBLEM),
        ("3,-7,1,1,5,5,1,-1,-1,-1", "bad_id", Grade.PROBLEM),
        ("3,3.0,1,1,5,5,1,-1,-1,-1", "float_ids", Grade.WARNING),
        ("3,0,1,1,5,5,1,-1,-1,-1", "id_0", Grade.WARNING),
        ("3,-1,1,1,5,5,1,-1,-1,-1", "id_negative", Grade.WARNING),
        ("3,3,1,1,5,5,1,2,-1,-1", "class", Grade.WARNING),
        ("3,3,1,1,5,5,17,-1,-1,-1", "confidence", Grade.NOTE),
        ("1,3,1,1,5,5,1,-1,-1,-1", "unsorted", Grade.NOTE),
    ],
)
def test_a_bad_row_is_remarked_on_with_its_line(tmp_path, row, kind, grade):
    report = inspect_text(tmp_path, RESULT + row + "\n")
    found = {remark.kind: remark for remark in report.remarks}
    assert found.pop(kind).grade is grade
    assert found.keys() <= {"unsorted"}  # frames 0 and −2 come after frame 2
    if kind not in {"class", "confidence"}:
        message = next(remark.message for remark in report.remarks if remark.kind == kind)
        assert "1 row (line 4" in message


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("frame,id,x,y,w,h,conf\n" + RESULT, "header"),
        ("\ufeff" + RESULT, "bom"),
        (RESULT.replace(",", " "), "separator"),
        (RESULT.replace(",", ";"), "separator"),
        ("1,1,10,20,30,40\n", "columns"),
        (RESULT + "3,1,1,1,1,1,1\n", "columns_differ"),
    ],
)
def test_a_file_of_another_form(tmp_path, text, kind):
    assert kinds(inspect_text(tmp_path, text)) == {kind}


def test_what_trackeval_does_not_score(tmp_path):
    report = inspect_text(tmp_path, GT + "3,2,1,1,5,5,0,3,1\n")
    assert kinds(report) == {"class", "ignored"}
    assert dict(report.facts)["classes"] == "1: 2, 3: 1"


def test_facts(tmp_path):
    facts = dict(inspect_text(tmp_path, RESULT).facts)
    assert facts["rows"] == "3, with 10 columns"
    assert facts["frames"] == "1 to 2 (counted from 1); 2 of them have rows"
    assert (facts["ids"], facts["confidence"]) == ("2", "0.8 to 1")
    assert facts["corners"].startswith("from 5, 5 on;")


def test_otb(tmp_path):
    report = inspect_text(tmp_path, "1,2,3,4\n5\t6\t7\t8\nNaN,NaN,NaN,NaN\n")
    assert (report.kind, kinds(report)) == ("otb", {"absent"})
    assert kinds(inspect_text(tmp_path, "1 2 3 4\n1 2 3\nx y z w\n")) == {"columns", "not_a_number"}
    assert kinds(inspect_text(tmp_path, "1,2,3,4,5,6,7,8\n")) == {"polygon"}


# ---- the archive ---------------------------------------------------------------------------


def archive(folder, members):
    path = folder / "task.zip"
    with zipfile.ZipFile(path, "w") as file:
        for name, text in members.items():
            file.writestr(name, text)
    return inspect_path(path)


def test_a_sound_archive(tmp_path):
    report = archive(
        tmp_path,
        {"gt/gt.txt": GT, "gt/labels.txt": "person\n", "seqinfo.ini": SEQINFO, "img1/1.jpg": ""},
    )
    assert (report.kind, report.remarks) == ("mot_zip", ())
    facts = dict(report.facts)
    assert (facts["labels.txt"], facts["seqinfo.ini"], facts["pictures"]) == ("person", "yes", "1")


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        ({"seqinfo.ini": SEQINFO.replace("frameRate=30", "frameRate=29.97")}, "seqinfo_whole"),
        ({"seqinfo.ini": SEQINFO.replace("imExt=.jpg\n", "")}, "seqinfo_keys"),
        ({"seqinfo.ini": "seqLength=2"}, "seqinfo"),
        ({"seqinfo.ini": SEQINFO.replace("seqLength=2", "seqLength=1")}, "seq_length"),
        ({"gt/gt.txt": GT + "3,2,1,1,5,5,1,2,1\n", "seqinfo.ini": None}, "labels_short"),
        ({"gt/labels.txt": "person\nperson\n"}, "labels_double"),
    ],
)
def test_what_cvat_refuses(tmp_path, changes, kind):
    members = {"gt/gt.txt": GT, "gt/labels.txt": "person\n", "seqinfo.ini": SEQINFO} | changes
    members = {name: text for name, text in members.items() if text is not None}
    assert kinds(archive(tmp_path, members)) - {"class"} == {kind}


def test_classes_without_names_and_rows_of_a_result(tmp_path):
    assert "labels_missing" in kinds(archive(tmp_path, {"gt/gt.txt": "1,1,1,1,5,5,1,77,1\n"}))
    assert kinds(archive(tmp_path, {"gt/gt.txt": RESULT})) == {"not_gt"}
    assert kinds(archive(tmp_path, {"a/gt/gt.txt": GT})) == {"prefix"}


def test_a_sequence_s_folder_and_its_seqinfo(tmp_path):
    (tmp_path / "gt").mkdir()
    (tmp_path / "gt" / "gt.txt").write_text(GT)
    (tmp_path / "seqinfo.ini").write_text(SEQINFO.replace("seqLength=2", "seqLength=x"))
    report = inspect_path(tmp_path)
    assert (report.kind, kinds(report)) == ("mot_sequence", {"seqinfo_whole"})
    alone = inspect_path(tmp_path / "seqinfo.ini")
    assert (alone.kind, kinds(alone)) == ("seqinfo", {"seqinfo_whole"})


@pytest.mark.parametrize(("members", "kind"), [({}, "unknown"), ({"notes.txt": "x"}, "unknown")])
def test_other_archives(tmp_path, members, kind):
    report = archive(tmp_path, members)
    assert (report.kind, report.grade) == (kind, Grade.PROBLEM)
