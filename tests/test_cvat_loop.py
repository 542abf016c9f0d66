"""The loop of a team: import from CVAT, run, review, export to CVAT, correct there, import, run.

CVAT's part is played on the XML: what it writes when a person draws, and what it makes of a file
that it is sent, of which it keeps only boxes with ``keyframe="1"`` and to which it gives its own
track ids.
"""

import csv
import json
from xml.etree import ElementTree as ET

import pytest
from click.testing import CliRunner
from support.patch import box_at, write_patch

from situp_annotate.cli import cli
from situp_annotate.formats.manifest import load_manifest
from situp_annotate.results import read_video
from situp_annotate.types import BoundingBox, Keyframe, Provenance

FRAMES = 40
DRAWN = (0, 15, 30)
CORRECTED = 36
CORRECTION = BoundingBox(93.25, 41.5, 23.75, 22.25)


def box_element(frame, box, *, keyframe=True):
    return ET.Element(
        "box",
        frame=str(frame),
        keyframe=str(int(keyframe)),
        outside="0",
        occluded="0",
        xtl=f"{box.x:.2f}",
        ytl=f"{box.y:.2f}",
        xbr=f"{box.right:.2f}",
        ybr=f"{box.bottom:.2f}",
        z_order="0",
    )


def as_drawn_in_cvat(path):
    """What CVAT exports of three hand-drawn boxes: them, and what it put between them."""
    root = ET.Element("annotations")
    ET.SubElement(root, "version").text = "1.1"
    task = ET.SubElement(ET.SubElement(root, "meta"), "task")
    for name, text in (("name", "patch.mp4"), ("size", str(FRAMES)), ("mode", "interpolation")):
        ET.SubElement(task, name).text = text
    label = ET.SubElement(ET.SubElement(task, "labels"), "label")
    ET.SubElement(label, "name").text = "patch"
    size = ET.SubElement(task, "original_size")
    ET.SubElement(size, "width").text, ET.SubElement(size, "height").text = "160", "96"
    track = ET.SubElement(root, "track", id="0", label="patch", source="manual")
    for frame in range(FRAMES):
        track.append(box_element(frame, box_at(frame), keyframe=frame in DRAWN))
    ET.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def as_corrected_in_cvat(sent, back):
    """Import as CVAT does, draw one box, export again."""
    tree = ET.parse(sent)
    (track,) = tree.getroot().iter("track")
    track.set("id", "7")
    kept = [box for box in track.iter("box") if box.get("keyframe") == "1"]
    kept.append(box_element(CORRECTED, CORRECTION))
    for box in list(track):
        track.remove(box)
    for box in sorted(kept, key=lambda box: int(box.get("frame"))):
        track.append(box)
    tree.write(back, encoding="utf-8", xml_declaration=True)


def call(*arguments):
    outcome = CliRunner().invoke(cli, [str(argument) for argument in arguments])
    assert outcome.exit_code == 0, outcome.output
    return outcome.stdout


@pytest.fixture(scope="module")
def loop(tmp_path_factory):
    """The folder after the whole loop, and the labels before the correction."""
    folder = tmp_path_factory.mktemp("loop")
    write_patch(folder / "patch.mp4", FRAMES)
    as_drawn_in_cvat(folder / "task.xml")
    manifest, out = folder / "manifest.json", folder / "out"
    run = ("--output", out, "--recipe", "csv_only", "--executor", "serial")
    call("import", folder / "task.xml", "--output", manifest)
    call("run", manifest, *run)
    before = read_video(out / "patch")
    call("export", out, "--format", "cvat", "--output", folder / "exported")
    as_corrected_in_cvat(folder / "exported" / "cvat" / "patch.xml", folder / "corrected.xml")
    said = call(
        *("import", folder / "corrected.xml"),
        *("--corrects", out, "--output", folder / "corrected.json"),
    )
    assert "patch: 1 boxes changed or added" in said
    call("run", folder / "corrected.json", *run)
    return folder, before


def test_what_was_drawn_in_cvat_is_imported(loop):
    (job,) = load_manifest(loop[0] / "manifest.json").jobs
    (track,) = job.tracks
    assert (job.path.name, track.label) == ("patch.mp4", "patch")
    assert track.keyframes == tuple(Keyframe(frame, box_at(frame)) for frame in DRAWN)


def test_the_run_says_what_to_review(loop):
    with (loop[0] / "out" / "patch" / "review.csv").open(newline="") as file:
        assert next(csv.reader(file))[:4] == ["rank", "track_id", "label", "frame"]


def test_cvat_gets_keyframes_that_stand_for_all_labels(loop):
    folder, before = loop
    (track,) = ET.parse(folder / "exported" / "cvat" / "patch.xml").getroot().iter("track")
    boxes = list(track.iter("box"))
    assert {box.get("keyframe") for box in boxes} == {"1"}
    assert {*map(str, DRAWN), str(FRAMES - 1)} <= {box.get("frame") for box in boxes}
    assert len(boxes) < len(before.tracks[0].points) / 2


def test_only_the_correction_is_new_in_the_manifest(loop):
    (job,) = load_manifest(loop[0] / "corrected.json").jobs
    (track,) = job.tracks
    drawn = [Keyframe(frame, box_at(frame)) for frame in DRAWN]
    assert track.keyframes == (*drawn, Keyframe(CORRECTED, CORRECTION))
    assert track.id == 1


def test_only_what_is_beside_the_correction_is_tracked_anew(loop):
    folder, before = loop
    (video,) = json.loads((folder / "out" / "batch.json").read_text())["videos"]
    assert video["cache"]["reused"] == 4  # both ways between 0 and 15, and between 15 and 30
    assert video["cache"]["passes"] > 4
    after = read_video(folder / "out" / "patch").tracks[0].points
    untouched = range(DRAWN[-1] + 1)
    assert [after[f] for f in untouched] == [before.tracks[0].points[f] for f in untouched]
    assert after[CORRECTED].box == CORRECTION
    assert after[CORRECTED].provenance is Provenance.HUMAN
