"""CVAT for video 1.1: what is written, what comes back, and what is refused."""

import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.labelled import import_hints, labelled_track, labelled_video, labelled_videos

from situp_annotate.errors import SitupError
from situp_annotate.formats.cvat.exporting import write_cvat
from situp_annotate.formats.cvat.importing import read_cvat, recognizes_cvat
from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.keyframed import keyframes_of
from situp_annotate.propagation.thinning import overlaps
from situp_annotate.types import BoundingBox, Keyframe, Provenance, State

BOX = BoundingBox(10, 20, 30, 40)
OPTIONS = ExportOptions()
HINTS = import_hints()


def write(folder, video, options=OPTIONS):
    write_cvat([video], folder, options)
    return folder / f"{video.id}.xml"


def read(path, hints=HINTS):
    (seeds,) = read_cvat(path, hints)
    return seeds


def annotations(folder, body, meta="<meta><task><id>4</id><name>t</name></task></meta>"):
    path = folder / "annotations.xml"
    path.write_text(f"<annotations><version>1.1</version>{meta}{body}</annotations>")
    return path


def box(frame, more="", corners=(10, 20, 40, 60), inside=""):
    edges = "xtl='{}' ytl='{}' xbr='{}' ybr='{}'".format(*corners)
    flags = "" if "keyframe" in more else "keyframe='1'"
    return f"<box frame='{frame}' {edges} {flags} {more}>{inside}</box>"


def track(*boxes, track_id=0, more=""):
    return f"<track id='{track_id}' label='car' {more}>{''.join(boxes)}</track>"


# ---- export ------------------------------------------------------------------------------------


def test_a_file_is_as_cvat_writes_it(tmp_path):
    moving = {frame: BoundingBox(10 + 2 * frame, -5.126, 30, 40) for frame in range(6)}
    hidden = {6: (moving[5], State.OCCLUDED, Provenance.HUMAN)}
    video = labelled_video(
        labelled_track(3, {**moving, **hidden}, "car", {"colour": "red", "wheels": 4}),
        labelled_track(7, {}, "dog"),
        frame_count=9,
    )
    assert write(tmp_path, video).read_text() == (
        """<?xml version='1.0' encoding='utf-8'?>
<annotations>
  <version>1.1</version>
  <meta>
    <task>
      <name>clip</name>
      <size>9</size>
      <mode>interpolation</mode>
      <start_frame>0</start_frame>
      <stop_frame>8</stop_frame>
      <labels>
        <label>
          <name>car</name>
          <type>rectangle</type>
          <attributes>
            <attribute>
              <name>colour</name>
              <mutable>False</mutable>
              <input_type>text</input_type>
              <default_value />
              <values />
            </attribute>
            <attribute>
              <name>wheels</name>
              <mutable>False</mutable>
              <input_type>text</input_type>
              <default_value />
              <values />
            </attribute>
          </attributes>
        </label>
      </labels>
      <original_size>
        <width>640</width>
        <height>480</height>
      </original_size>
      <source>clip.mp4</source>
    </task>
  </meta>
  <track id="2" label="car" source="semi-auto">
"""
        + "".join(
            f"""    <box frame="{frame}" keyframe="1" outside="{outside}" occluded="{occluded}" """
            f"""xtl="{left}" ytl="-5.13" xbr="{right}" ybr="34.87" z_order="0">
      <attribute name="colour">red</attribute>
      <attribute name="wheels">4</attribute>
    </box>
"""
            for frame, outside, occluded, left, right in (
                (0, 0, 0, "10.00", "40.00"),
                (5, 0, 0, "20.00", "50.00"),
                (6, 0, 1, "20.00", "50.00"),
                (7, 1, 0, "20.00", "50.00"),
            )
        )
        + """  </track>
</annotations>
"""
    )


def test_a_track_to_the_last_frame_has_no_end(tmp_path):
    path = write(tmp_path, labelled_video(labelled_track(1, {0: BOX, 1: BOX}), frame_count=2))
    assert [keyframe.box for keyframe in read(path).tracks[0].keyframes] == [BOX, BOX]


def test_what_no_xml_may_hold_is_replaced(tmp_path):
    video = labelled_video(labelled_track(1, {0: BOX}, "a\x00b\ud800", {"\x01": "\x02"}))
    (seed,) = read(write(tmp_path, video)).tracks
    assert (seed.label, seed.attributes) == ("a�b�", {"�": "�"})


@given(labelled_videos())
def test_nothing_is_written_that_cvat_breaks_on(tmp_path_factory, video):
    """It refuses unknown labels, frames past the end, tracks without boxes, frames not in order."""
    path = write(tmp_path_factory.mktemp("cvat"), video, ExportOptions(states=tuple(State)))
    root = ElementTree.parse(path).getroot()
    declared = {name.text for name in root.iterfind("meta/task/labels/label/name")}
    for element in root.iterfind("track"):
        assert element.get("label") in declared
        frames = [int(shape.get("frame")) for shape in element]
        assert frames == sorted(set(frames))
        assert 0 <= frames[0] <= frames[-1] < video.frame_count
        outside = [shape.get("outside") for shape in element]
        assert outside[0] == "0"
        assert "11" not in "".join(outside)


# ---- round trips -------------------------------------------------------------------------------


def close(box):
    """Corners have two decimals, sizes are at least a hundredth."""
    return pytest.approx((box.x, box.y, box.x + box.width, box.y + box.height), abs=0.0151)


@given(labelled_videos())
def test_keyframes_come_back(tmp_path_factory, video):
    seeds = read(write(tmp_path_factory.mktemp("cvat"), video))
    assert seeds.name == "clip.mp4"
    assert not seeds.notes
    found = {seed.id: seed for seed in seeds.tracks}
    for labelled in video.tracks:
        expected = keyframes_of(
            labelled, frame_count=video.frame_count, iou=0.9, states=OPTIONS.states, decimals=2
        )
        if not expected:
            assert labelled.track.id not in found
            continue
        seed = found[labelled.track.id]
        assert seed.label == labelled.track.label
        assert [(k.frame, k.occluded, k.box is None) for k in seed.keyframes] == [
            (k.frame, k.occluded, k.box is None) for k in expected
        ]
        for ours, theirs in zip(expected, seed.keyframes, strict=True):
            if ours.box and theirs.box:
                assert (theirs.box.x, theirs.box.y, theirs.box.right, theirs.box.bottom) == close(
                    ours.box
                )


@given(labelled_videos(least_size=5), st.sampled_from([0.5, 0.9, 0.95]))
@settings(max_examples=50)
def test_interpolation_gives_the_labels_back(tmp_path_factory, video, iou):
    path = write(tmp_path_factory.mktemp("cvat"), video, ExportOptions(iou=iou))
    found = {seed.id: seed for seed in read(path).tracks}
    for labelled in video.tracks:
        if boxes := {f: p.box for f, p in labelled.in_states(OPTIONS.states).items()}:
            keyframes = found[labelled.track.id].keyframes
            known = {k.frame: k.box for k in keyframes if k.box}
            assert np.all(overlaps(boxes, known) >= iou - 1e-9)


def test_attributes_come_back_as_text_where_they_change(tmp_path):
    points = dict.fromkeys(range(6), (BOX, State.VISIBLE, Provenance.HUMAN))
    attributes = {"colour": "red", "pose": [[0, "sits"], [2, "stands"], [4, "sits"]], "n": 3}
    video = labelled_video(labelled_track(1, points, "dog", attributes), frame_count=6)
    path = write(tmp_path, video)
    assert read(path).tracks[0].attributes == {**attributes, "n": "3"}
    mutable = {
        attribute.findtext("name"): attribute.findtext("mutable")
        for attribute in ElementTree.parse(path).iterfind("meta/task/labels/label/attributes/*")
    }
    assert mutable == {"colour": "False", "pose": "True", "n": "False"}


def test_attributes_change_where_they_did_though_no_box_does(tmp_path):
    attributes = {"pose": [[1, "sits"], [4, "stands"], [7, "sits"]], "colour": [[2, "red"]]}
    points = dict.fromkeys([*range(10), *range(14, 20)], BOX)
    video = labelled_video(labelled_track(1, points, "dog", attributes))
    found = read(write(tmp_path, video)).tracks[0]
    assert found.attributes == {
        "pose": [[0, "sits"], [4, "stands"], [7, "sits"]],
        "colour": "red",
    }
    assert [keyframe.frame for keyframe in found.keyframes] == [0, 4, 7, 9, 10, 14, 19]


# ---- import ------------------------------------------------------------------------------------


def test_boxes_between_keyframes_are_not_taken(tmp_path):
    body = track(
        box(3, "occluded='1'"),
        box(4, "keyframe='0'", (11, 21, 41, 61)),
        box(5, corners=(12.25, 22.5, 42.75, 62)),
        box(6, "outside='1'"),
        box(9, "outside='0'"),
    )
    seeds = read(annotations(tmp_path, body))
    assert seeds.name == "t"
    (seed,) = seeds.tracks
    assert (seed.id, seed.label) == (1, "car")
    assert seed.keyframes == (
        Keyframe(3, BOX, occluded=True),
        Keyframe(5, BoundingBox(12.25, 22.5, 30.5, 39.5)),
        Keyframe(6, None),
        Keyframe(9, BOX),
    )


def test_outside_at_the_start_or_again_says_nothing_new(tmp_path):
    gone = "outside='1' occluded='1'"
    body = track(box(0, gone), box(7, gone), box(2), box(5, gone, (9, 9, 1, 1)), box(5, gone))
    (seed,) = read(annotations(tmp_path, body)).tracks
    assert seed.keyframes == (Keyframe(2, BOX), Keyframe(5, None))


def test_tracks_come_by_id_and_those_without_a_box_are_named(tmp_path):
    body = track(box(0), track_id=8) + track(box(0, "outside='1'"), track_id=1) + track(box(1))
    seeds = read(annotations(tmp_path, body))
    assert [seed.id for seed in seeds.tracks] == [1, 9]
    (note,) = seeds.notes
    assert note == 'CVAT\'s track 1 ("car") was left out, for it has no box.'


def test_other_shapes_are_left_out_and_named(tmp_path):
    polygon = "<polygon frame='0' keyframe='1' outside='0' occluded='0' points='1,1;2,2;3,1'/>"
    bones = f"<skeleton frame='0' keyframe='1'>{box(0)}</skeleton>"
    seeds = read(annotations(tmp_path, track(polygon, bones) + track(box(4), track_id=1)))
    assert [seed.id for seed in seeds.tracks] == [2]
    assert "polygon, skeleton" in seeds.notes[0]


def test_turned_boxes_become_the_upright_ones_around_them(tmp_path):
    seeds = read(annotations(tmp_path, track(box(0, "rotation='90.00'"))))
    around = seeds.tracks[0].keyframes[0].box
    assert (around.x, around.y, around.width, around.height) == pytest.approx((5, 25, 40, 30))
    assert "turned" in seeds.notes[0]


def test_pixels_may_count_from_one(tmp_path):
    path = annotations(tmp_path, track(box(0)))
    assert read(path, import_hints(pixel_origin=1)).tracks[0].keyframes[0].box == BoundingBox(
        9, 19, 30, 40
    )


def test_attributes_hold_until_they_change(tmp_path):
    def pose(text):
        return f"<attribute name='pose'>{text}</attribute><attribute name='note'></attribute>"

    body = track(
        box(9, "outside='1'", inside=pose("gone")),
        box(0, inside=pose("sits")),
        box(3),
        box(5, inside=pose("sits")),
        box(7, inside=pose("runs")),
    )
    (seed,) = read(annotations(tmp_path, body)).tracks
    assert seed.attributes == {"pose": [[0, "sits"], [7, "runs"]], "note": ""}


def test_a_project_gives_seeds_for_each_task(tmp_path):
    meta = (
        "<meta><project><tasks><task><id>4</id><name>a</name><source>a.mp4</source></task>"
        "<task><id>6</id><name>b</name></task></tasks></project></meta>"
    )
    body = track(box(0), more="task_id='6'") + track(box(1), track_id=1, more="task_id='4'")
    seeds = read_cvat(annotations(tmp_path, body, meta), HINTS)
    assert [(s.name, [t.id for t in s.tracks]) for s in seeds] == [("b", [1]), ("a.mp4", [2])]


def test_an_archive_is_read_like_the_file_in_it(tmp_path):
    path = annotations(tmp_path, track(box(0)))
    archive = tmp_path / "task.zip"
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        file.write(path, "annotations.xml")
    assert read(archive) == read(path)
    assert recognizes_cvat(archive, archive.read_bytes()[:100])
    assert recognizes_cvat(path, path.read_bytes()[:100])
    assert not recognizes_cvat(path, b"PK")
    assert not recognizes_cvat(path, b"1,1,2,3,4,5,1")


# ---- what is refused ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (track(box("x")), r'track 0 \("car"\): frame=\'x\' is not allowed; give a whole number'),
        (track(box(-1)), "frame='-1'"),
        (track(box(2**31)), "frame='2147483648'"),
        (track(box(5, corners=(1, 2, "nan", 4))), "box at frame 5: xbr='nan' is not allowed"),
        (track(box(5, corners=(1, 2, "1e999", 4))), "xbr='1e999'"),
        (track(box(5, corners=(1, 2, 1, 4))), "box at frame 5: A box needs a positive width"),
        (track(box(5, corners=("-1e308", 2, "1e308", 4))), "box at frame 5: A box needs"),
        (track(box(5, "occluded='yes'")), "occluded='yes' is not allowed; give 0 or 1"),
        (track(box(5, "keyframe='2'")), "keyframe='2'"),
        (track("<box frame='1' outside='1'/>"), "keyframe is missing"),
        (track("<box frame='1' keyframe='1'/>"), "box at frame 1: xtl is missing"),
        (track(box(5), box(5, corners=(1, 1, 2, 2))), "there is another box at this frame"),
        (track(box(5, inside="<attribute/>")), "box at frame 5: name is missing"),
        (track(box(5, "rotation='a'")), "rotation='a'"),
        (track(box(1)) + track(box(2)), "there are two tracks 0"),
        (f"<track id='1'>{box(1)}</track>", "track 1: label is missing"),
        (f"<track label='car'>{box(1)}</track>", "a track: id is missing"),
        (f"<track id='1' label=' '>{box(1)}</track>", "track 1: ' ' cannot be a label"),
        (f"<track id='1' label='a&#13;b'>{box(1)}</track>", r"track 1: 'a\\rb' cannot be a label"),
        ("<image id='0' name='a.png'/>", 'export the task from CVAT as "CVAT for video 1.1"'),
        ("<track>", "not XML as CVAT writes it"),
    ],
)
def test_wrong_values_are_named_with_their_place(tmp_path, body, message):
    with pytest.raises(SitupError, match=rf"annotations\.xml: .*{message}"):
        read(annotations(tmp_path, body))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not XML"),
        ("{}", "not XML"),
        ("<html></html>", "begins with <html>"),
        ("<?xml version='1.0' encoding='klingon'?><annotations/>", "not XML"),
        ("<!DOCTYPE a [<!ENTITY x 'y'>]><annotations>&x;</annotations>", "not XML"),
        ("<!DOCTYPE a SYSTEM 'http://localhost/a'><annotations/>", "not XML"),
    ],
)
def test_what_is_not_cvats_is_refused(tmp_path, text, message):
    path = tmp_path / "file.xml"
    path.write_text(text)
    with pytest.raises(SitupError, match=rf"file\.xml: .*{message}"):
        read(path)


def test_files_that_cannot_be_read_are_named(tmp_path):
    with pytest.raises(SitupError, match=r"none\.xml: cannot be read"):
        read(tmp_path / "none.xml")
    archive = tmp_path / "task.zip"
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("readme.txt", "hello")
    with pytest.raises(SitupError, match=r"task\.zip: there is no annotations\.xml"):
        read(archive)
