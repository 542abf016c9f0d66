"""``situp-annotate import``: what it writes, what it says, and what it refuses."""

import dataclasses

import pytest
from click.testing import CliRunner
from support.patch import box_at, patch_job, write_patch

from situp_annotate.batch import annotate_batch
from situp_annotate.cli import cli
from situp_annotate.cli.import_ import import_ as command
from situp_annotate.formats.importing import IMPORTERS
from situp_annotate.formats.manifest import load_manifest
from situp_annotate.recipe import load_recipe
from situp_annotate.types import BoundingBox, Keyframe


def import_(*arguments):
    return CliRunner().invoke(cli, ["import", *map(str, arguments)])


def mot_rows(*frames, track_id=1):
    """Rows as of a MOT file, of the patch's true boxes; frames from 0."""
    boxes = ((frame, box_at(frame)) for frame in frames)
    return "".join(
        f"{frame + 1},{track_id},{box.x},{box.y},{box.width},{box.height},1,1,1\n"
        for frame, box in boxes
    )


@pytest.fixture
def folder(tmp_path):
    write_patch(tmp_path / "one.mp4")
    write_patch(tmp_path / "two.mp4")
    (tmp_path / "one.txt").write_text(mot_rows(0, 1, 2))
    (tmp_path / "two.txt").write_text(mot_rows(4, 5))
    return tmp_path


def test_every_format_can_be_named():
    (option,) = (param for param in command.params if param.name == "name")
    assert set(option.type.choices) == set(IMPORTERS)


def test_files_find_their_videos_and_become_a_manifest(folder):
    target = folder / "m.json"
    outcome = import_(folder / "one.txt", folder / "two.txt", "--output", target)
    assert outcome.exit_code == 0, outcome.output
    one, two = load_manifest(target).jobs
    assert (one.id, one.path, two.id) == ("one", folder / "one.mp4", "two")
    assert one.tracks[0].keyframes[:3] == tuple(Keyframe(f, box_at(f)) for f in (0, 1, 2))
    assert "2 videos, 2 tracks" in outcome.stdout
    assert CliRunner().invoke(cli, ["check", str(target)]).exit_code == 0


def test_labels_are_named(folder):
    (folder / "labels.txt").write_text("van\n")
    target = folder / "m.json"
    options = ("--labels", folder / "labels.txt", "--pixel-origin", "1", "--output", target)
    assert import_(folder / "one.txt", *options).exit_code == 0
    (track,) = load_manifest(target).jobs[0].tracks
    assert track.label == "van"
    assert track.keyframes[0].box == BoundingBox(19, 39, 24, 24)


def test_the_manifest_may_lie_elsewhere(folder, tmp_path_factory):
    target = tmp_path_factory.mktemp("away") / "m.json"
    outcome = import_(folder / "one.txt", "--output", target)
    assert "--allow-outside" in outcome.stderr
    assert load_manifest(target, allow_outside=True).jobs[0].path == folder / "one.mp4"


def test_nothing_is_replaced_unasked(folder):
    target = folder / "m.json"
    target.write_text("drawn by hand")
    outcome = import_(folder / "one.txt", "--output", target)
    assert outcome.exit_code == 5
    assert target.read_text() == "drawn by hand"
    assert import_(folder / "one.txt", "--output", target, "--overwrite").exit_code == 0
    assert load_manifest(target).jobs


def test_two_files_for_one_video_are_refused(folder):
    options = ("--videos", folder / "one.mp4", "--output", folder / "m.json")
    outcome = import_(folder / "one.txt", folder / "two.txt", *options)
    assert outcome.exit_code == 1
    assert "two.txt" in outcome.stderr
    assert "one.txt has boxes for" in outcome.stderr
    assert not (folder / "m.json").exists()


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("none.txt", None, "cannot be read"),
        ("odd.txt", "dear diary", "none of the formats"),
        ("one.txt", "1,1,5,5,abc,9,1,1,1\n", "one.txt"),
        ("three.txt", mot_rows(0), "no video named 'three'"),
    ],
)
def test_what_cannot_be_imported_is_named(folder, name, text, words):
    if text is not None:
        (folder / name).write_text(text)
    outcome = import_(folder / name, "--output", folder / "m.json")
    assert outcome.exit_code == 1
    assert words in outcome.stderr
    assert not (folder / "m.json").exists()


@pytest.fixture
def run(folder):
    """Jobs of a run of both videos and one that fails, its output folder, and the export."""
    jobs = [
        patch_job(folder / "one.mp4", 0, 8, video_id="a"),
        patch_job(folder / "two.mp4", 2, video_id="b"),
        patch_job(folder / "gone.mp4", 2, video_id="c"),
    ]
    out = folder / "out"
    annotate_batch(jobs, out, load_recipe("csv_only"), executor="serial")
    for name in ("cvat", "mot"):
        CliRunner().invoke(cli, ["export", str(out), "-f", name, "-o", str(folder / "e")])
    return jobs, out, folder / "e"


def test_videos_without_corrections_stay_as_the_run_had_them(folder, run):
    jobs, out, exported = run
    options = ("--corrects", out, "--output", folder / "m.json")
    outcome = import_(exported / "cvat" / "a.xml", *options)
    assert outcome.exit_code == 0, outcome.output
    assert "a: 0 boxes changed or added, 0 tracks added, 0 removed" in outcome.stdout
    assert "c failed in this run" in outcome.stderr
    loaded = load_manifest(folder / "m.json").jobs
    assert [dataclasses.replace(job, manifest_sha256=None) for job in loaded] == jobs[:2]


def test_corrections_come_in_formats_that_give_everything_back(folder, run):
    _, out, exported = run
    options = ("--corrects", out, "--output", folder / "m.json")
    outcome = import_(exported / "mot" / "a.txt", *options)
    assert outcome.exit_code == 1
    assert "a.txt: corrections are read from cvat or label-studio" in outcome.stderr
    outcome = import_(exported / "cvat" / "a.xml", *options, "--videos", folder)
    assert outcome.exit_code == 2
    assert not (folder / "m.json").exists()
