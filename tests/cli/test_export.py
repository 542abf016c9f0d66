"""``situp-annotate export``: what it writes, what it says, and what it refuses."""

import dataclasses

import pytest
from click.testing import CliRunner
from support.patch import patch_job, write_patch

from situp_annotate.batch import annotate_batch
from situp_annotate.cli import cli
from situp_annotate.cli.export import export as command
from situp_annotate.formats.exporting import EXPORTERS
from situp_annotate.recipe import load_recipe


def export(*arguments):
    return CliRunner().invoke(cli, ["export", *map(str, arguments)])


def contents(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """A run of two videos, whose recipe asks for every export."""
    clip = write_patch(tmp_path_factory.mktemp("clips") / "patch.mp4")
    jobs = [patch_job(clip, 0, 6), patch_job(clip, 3, video_id="second")]
    output = tmp_path_factory.mktemp("run") / "out"
    recipe = load_recipe("csv_only", [f"outputs.exports={list(EXPORTERS)}"])
    annotate_batch(jobs, output, recipe, executor="serial")
    return output


def test_every_format_can_be_asked_for():
    (option,) = (param for param in command.params if param.name == "names")
    assert set(option.type.choices) == set(EXPORTERS)


@pytest.mark.parametrize("name", EXPORTERS)
def test_a_format_is_written_for_all_videos(out, tmp_path, name):
    outcome = export(out, "--format", name, "--output", tmp_path / "e")
    assert outcome.exit_code == 0, outcome.output
    assert outcome.stdout == f"{name}: 2 videos in {tmp_path / 'e' / name}\n"
    assert contents(tmp_path / "e" / name)
    assert sorted(path.name for path in (tmp_path / "e").iterdir()) == [name]


@pytest.mark.parametrize("name", EXPORTERS)
def test_a_recipe_writes_the_same_as_the_command(out, tmp_path, name):
    export(out, "--format", name, "--output", tmp_path, "--video", "second")
    assert contents(tmp_path / name) == contents(out / "second" / name)


def test_nothing_is_replaced_unasked(out, tmp_path):
    arguments = (out, "--format", "cvat", "--output", tmp_path)
    export(*arguments)
    (tmp_path / "cvat" / "patch.xml").write_text("corrected")
    outcome = export(*arguments)
    assert outcome.exit_code == 5
    assert "--overwrite" in outcome.stderr
    assert (tmp_path / "cvat" / "patch.xml").read_text() == "corrected"
    assert export(*arguments, "--overwrite").exit_code == 0
    assert (tmp_path / "cvat" / "patch.xml").read_text() != "corrected"


def test_unknown_videos_and_folders_are_named(out, tmp_path):
    outcome = export(out, "--format", "cvat", "--output", tmp_path, "--video", "third")
    assert outcome.exit_code == 1
    assert "'third'; known are: patch, second." in outcome.stderr
    outcome = export(tmp_path, "--format", "cvat")
    assert outcome.exit_code == 1
    assert "give the output folder of `situp-annotate run`" in outcome.stderr


def test_a_run_without_good_videos_has_nothing_to_export(tmp_path):
    job = dataclasses.replace(patch_job(tmp_path / "gone.mp4", 0))
    annotate_batch([job], tmp_path / "out", load_recipe("csv_only"), executor="serial")
    outcome = export(tmp_path / "out", "--format", "cvat", "--output", tmp_path / "e")
    assert outcome.exit_code == 1
    assert "no video" in outcome.stderr
    assert not (tmp_path / "e").exists()


def test_lost_boxes_come_only_when_asked_for(out, tmp_path):
    text = (out / "patch" / "labels.csv").read_text()
    lost = tmp_path / "out"
    (lost / "patch").mkdir(parents=True)
    for path in (out / "batch.json", *(out / "patch").iterdir()):
        if path.is_file():
            (lost / path.relative_to(out)).write_bytes(path.read_bytes())
    rows = text.splitlines()
    rows[-1] = rows[-1].replace(",visible,", ",lost,")
    (lost / "patch" / "labels.csv").write_text("\n".join(rows) + "\n")
    rows_of = {}
    for options in ((), ("--lost",)):
        target = tmp_path / f"e{len(options)}"
        export(lost, "--format", "mot", "--video", "patch", "--output", target, *options)
        rows_of[options] = len((target / "mot" / "patch.txt").read_text().splitlines())
    assert rows_of == {(): 11, ("--lost",): 12}


def test_a_folder_of_the_run_is_no_place_for_exports(tmp_path):
    clip = write_patch(tmp_path / "patch.mp4")
    job = patch_job(clip, 0, video_id="csv")
    annotate_batch([job], tmp_path / "out", load_recipe("csv_only"), executor="serial")
    before = contents(tmp_path / "out")
    outcome = export(tmp_path / "out", "-f", "csv", "-o", tmp_path / "out", "--overwrite")
    assert outcome.exit_code == 5
    assert "this is a folder of the run" in outcome.stderr
    assert contents(tmp_path / "out") == before
