"""CVAT's XML: what would be lost, and what is no such file."""

import zipfile

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from situp_annotate.inspection import Grade, inspect_path

BOX = '<box frame="{}" keyframe="{}" outside="{}" occluded="0" xtl="1" ytl="2" xbr="9" ybr="8"/>'
META = (
    "<meta><task><size>100</size><mode>interpolation</mode><labels><label><name>car</name>"
    "</label></labels><original_size><width>640</width><height>480</height></original_size>"
    "<source>a.mp4</source></task></meta>"
)


def document(*tracks, meta=META):
    inner = "".join(
        f'<track id="{number}" label="car">{"".join(boxes)}</track>'
        for number, boxes in enumerate(tracks)
    )
    return f"<?xml version='1.0'?><annotations><version>1.1</version>{meta}{inner}</annotations>"


def box(frame, keyframe=1, outside=0):
    return BOX.format(frame, keyframe, outside)


SOUND = document([box(0), box(5), box(9, outside=1)], [box(3)])


def inspect_xml(folder, text):
    path = folder / "annotations.xml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return inspect_path(path)


def kinds(report):
    return {remark.kind for remark in report.remarks}


def test_a_sound_file(tmp_path):
    report = inspect_xml(tmp_path, SOUND)
    assert report.remarks == ()
    assert report.title == "CVAT for video 1.1, 2 tracks, 4 boxes"
    facts = dict(report.facts)
    assert (facts["picture"], facts["video"], facts["labels"]) == ("640 × 480", "a.mp4", "car: 2")
    assert facts["boxes"].startswith("4, of which 4 are keyframes; 1 say")
    assert facts["task"] == "100 frames, mode interpolation"


@pytest.mark.parametrize(
    ("boxes", "kind", "grade"),
    [
        ([box(0), box(1, keyframe=0), box(2)], "not_keyframes", Grade.NOTE),
        ([box(0), box(0)], "double", Grade.PROBLEM),
        ([box(0), box(3, outside=1), box(4, outside=1)], "double_end", Grade.WARNING),
        ([box(4), box(2)], "unsorted", Grade.NOTE),
        ([box(0), box(100)], "past_the_end", Grade.WARNING),
        ([box(0).replace('xbr="9"', 'xbr="1"')], "empty_box", Grade.WARNING),
        ([box(0), box(1).replace("xtl", "left")], "not_a_box", Grade.PROBLEM),
        ([box(0), '<polygon frame="1" points="1,2"/>'], "shapes", Grade.WARNING),
    ],
)
def test_what_bites(tmp_path, boxes, kind, grade):
    report = inspect_xml(tmp_path, document(boxes))
    assert [(remark.kind, remark.grade) for remark in report.remarks] == [(kind, grade)]


def test_boxes_that_cvat_drops(tmp_path):
    report = inspect_xml(tmp_path, document([box(0), box(1, keyframe=0, outside=1)]))
    assert kinds(report) == {"not_keyframes", "lost_switch"}
    report = inspect_xml(tmp_path, document([box(0, keyframe=0), box(1, keyframe=0)]))
    assert kinds(report) == {"not_keyframes", "no_keyframe"}
    assert "2 boxes of 2 are not keyframes" in report.remarks[-1].message


def test_labels_that_the_task_lacks(tmp_path):
    text = SOUND.replace("<name>car</name>", "<name>van</name>")
    assert kinds(inspect_xml(tmp_path, text)) == {"labels"}


def test_images_are_told_apart(tmp_path):
    text = '<annotations><image id="0" name="a.jpg"><box label="car"/></image></annotations>'
    report = inspect_xml(tmp_path, text)
    assert kinds(report) == {"images"}
    assert report.title.startswith("CVAT for images")


def test_no_annotations_yet(tmp_path):
    assert kinds(inspect_xml(tmp_path, document())) == {"empty"}


@pytest.mark.parametrize(
    "text",
    [
        SOUND[:300],
        "<annotations><track></annotations>",
        '<!DOCTYPE a [<!ENTITY b "c">]><annotations>&b;</annotations>',
        '<!DOCTYPE a SYSTEM "file:///etc/passwd"><annotations/>',
        "<annotations>" + "<a>" * 200,
        "<?xml version='1.0' encoding='no-such'?><annotations/>",
        "<",
    ],
)
def test_what_cannot_be_read(tmp_path, text):
    report = inspect_xml(tmp_path, text)
    assert (report.kind, report.grade) == ("cvat", Grade.PROBLEM)
    assert "passwd" not in str(report.facts)


def test_text_without_end_is_given_up(tmp_path):
    report = inspect_xml(tmp_path, b"<annotations>" + b"x" * (3 * 2**20))
    assert "2 MiB without a tag" in report.remarks[0].message


def test_other_xml(tmp_path):
    assert inspect_xml(tmp_path, "<svg></svg>").kind == "unknown"


def test_in_an_archive(tmp_path):
    path = tmp_path / "task.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("annotations.xml", SOUND)
        archive.writestr("images/a.jpg", b"")
    report = inspect_path(path)
    assert (report.kind, report.remarks) == ("cvat", ())


SPOTS = st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), max_size=8)


@given(spots=SPOTS, share=st.floats(0, 1), zipped=st.booleans())
@settings(max_examples=150, deadline=None)
def test_any_damaged_file_is_answered(tmp_path_factory, spots, share, zipped):
    path = tmp_path_factory.mktemp("damaged") / "annotations.xml"
    content = SOUND.encode()
    if zipped:
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("annotations.xml", content)
        content = path.read_bytes()
    damaged = bytearray(content[: 1 + int(share * len(content))])
    for place, value in spots:
        damaged[int(place * (len(damaged) - 1))] = value
    path.write_bytes(damaged)
    assert inspect_path(path).title
