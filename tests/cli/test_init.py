"""``situp-annotate init``: the manifest it writes, and what it refuses."""

import json
import os
from fractions import Fraction

import pytest
from click.testing import CliRunner
from support.media import write_image_folder, write_video

from situp_annotate.cli import cli
from situp_annotate.formats.manifest import load_manifest


def init(*arguments):
    return CliRunner().invoke(cli, ["init", *map(str, arguments)])


@pytest.fixture
def clips(tmp_path):
    folder = tmp_path / "clips"
    (folder / "night").mkdir(parents=True)
    write_video(folder / "10.mp4", count=5)
    write_video(folder / "2.mp4", count=7, rate=Fraction(30000, 1001), size_hw=(32, 96))
    write_video(folder / "night" / "a.mp4", count=3)
    (folder / "notes.txt").write_text("no video")
    return folder


def test_the_skeleton(clips):
    outcome = init(clips)
    assert outcome.exit_code == 0, outcome.output
    assert json.loads((clips / "manifest.json").read_text()) == {
        "version": 1,
        "videos": [
            {
                "path": "2.mp4",
                "id": "2",
                "info": {"width": 96, "height": 32, "frame_rate": "30000/1001", "frames": 7},
                "tracks": [],
            },
            {
                "path": "10.mp4",
                "id": "10",
                "info": {"width": 64, "height": 48, "frame_rate": 30, "frames": 5},
                "tracks": [],
            },
            {
                "path": "night/a.mp4",
                "id": "night-a",
                "info": {"width": 64, "height": 48, "frame_rate": 30, "frames": 3},
                "tracks": [],
            },
        ],
    }
    assert outcome.stdout == ""
    assert f"Wrote {clips / 'manifest.json'}: 3 videos, 15 frames." in outcome.stderr
    assert f"situp-annotate check {clips / 'manifest.json'}" in outcome.stderr
    assert sorted(path.name for path in clips.iterdir()) == [
        *("10.mp4", "2.mp4", "manifest.json", "night", "notes.txt"),
    ]


def test_what_init_writes_and_shows_is_what_check_takes(clips):
    shown = init(clips).stderr
    manifest = clips / "manifest.json"
    (example,) = [line for line in shown.splitlines() if line.startswith('  {"id"')]
    document = json.loads(manifest.read_text())
    example = example.replace("[x, y, width, height]", "[1, 2, 3, 4]")
    document["videos"][0]["tracks"].append(json.loads(example))
    manifest.write_text(json.dumps(document))
    outcome = CliRunner().invoke(cli, ["check", str(manifest)])
    assert outcome.exit_code == 0, outcome.output


def test_does_not_overwrite_without_force(clips):
    (clips / "manifest.json").write_text("boxes")
    outcome = init(clips)
    assert outcome.exit_code == 5
    assert "there is a file already" in outcome.stderr
    assert "--force" in outcome.stderr
    assert (clips / "manifest.json").read_text() == "boxes"
    assert init(clips, "--force").exit_code == 0
    assert len(load_manifest(clips / "manifest.json").jobs) == 3


def test_output_in_a_folder_above(clips, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    outcome = init("clips", "--output", "all.json")
    assert outcome.exit_code == 0
    assert "--allow-outside" not in outcome.stderr
    jobs = load_manifest("all.json").jobs
    assert [job.path.as_posix() for job in jobs] == [
        *("clips/2.mp4", "clips/10.mp4", "clips/night/a.mp4")
    ]
    assert [job.id for job in jobs] == ["clips-2", "clips-10", "clips-night-a"]


def test_output_elsewhere_needs_allow_outside_and_says_so(clips, tmp_path):
    (tmp_path / "else").mkdir()
    output = tmp_path / "else" / "m.json"
    outcome = init(clips, "--output", output)
    assert outcome.exit_code == 0
    assert "--allow-outside" in outcome.stderr
    jobs = load_manifest(output, allow_outside=True).jobs
    assert jobs[0].path == clips / "2.mp4"


def test_what_cannot_be_decoded_is_left_out_with_the_reason(clips):
    (clips / "broken.mp4").write_text("no video")
    outcome = init(clips)
    assert outcome.exit_code == 1
    (line,) = [line for line in outcome.stderr.splitlines() if line.startswith("Left out: ")]
    assert "broken.mp4" in line
    assert len(load_manifest(clips / "manifest.json").jobs) == 3


@pytest.mark.skipif(os.name != "posix", reason="only here may file names be any bytes")
def test_names_that_json_cannot_say_are_left_out(clips):
    os.rename(os.fsencode(clips / "10.mp4"), os.fsencode(clips) + b"/\xff.mp4")  # noqa: PTH104
    outcome = init(clips)
    assert outcome.exit_code == 1
    assert "the name is not valid UTF-8" in outcome.stderr
    assert len(load_manifest(clips / "manifest.json").jobs) == 2


def test_folders_of_pictures_have_no_frame_rate(tmp_path):
    write_image_folder(tmp_path / "Car4" / "img", count=4)
    assert init(tmp_path).exit_code == 0
    (video,) = json.loads((tmp_path / "manifest.json").read_text())["videos"]
    assert video["id"] == "Car4"
    assert video["info"] == {"width": 64, "height": 48, "frames": 4}


def test_names_that_give_the_same_id_are_numbered(tmp_path):
    write_video(tmp_path / "a.mp4", count=2)
    write_video(tmp_path / "a.avi", count=2)
    assert init(tmp_path).exit_code == 0
    assert {job.id for job in load_manifest(tmp_path / "manifest.json").jobs} == {"a", "a-2"}


def test_nothing_to_write(tmp_path):
    outcome = init(tmp_path)
    assert outcome.exit_code == 1
    assert "there are no videos" in outcome.stderr
    (tmp_path / "broken.mp4").write_text("no video")
    outcome = init(tmp_path)
    assert outcome.exit_code == 1
    assert "no video can be decoded" in outcome.stderr
    assert not (tmp_path / "manifest.json").exists()


def test_where_nothing_can_be_written(clips, tmp_path):
    (tmp_path / "file").touch()
    outcome = init(clips, "--output", tmp_path / "file" / "m.json")
    assert outcome.exit_code == 5
    assert "cannot write here" in outcome.stderr


def test_a_folder_that_is_none_is_wrong_use(tmp_path):
    assert init(tmp_path / "nothing").exit_code == 2
