"""Run again, and only what is missing, failed or changed is done."""

import json
import os
import shutil
from dataclasses import replace

import pytest
from support.media import write_video

from situp_annotate.batch import annotate_batch, planned_batch
from situp_annotate.batch.resuming import stamp_of
from situp_annotate.recipe import load_recipe
from situp_annotate.types import BoundingBox, Keyframe, Track, VideoJob

RECIPE = load_recipe("csv_only")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Three videos and what a run has made of them."""
    folder = tmp_path_factory.mktemp("made")
    tracks = (Track(1, "thing", (Keyframe(0, BoundingBox(8, 8, 24, 24)),)),)
    jobs = [VideoJob(name, write_video(folder / f"{name}.mp4", count=4), tracks) for name in "abc"]
    report = annotate_batch(jobs, folder / "out", RECIPE, executor="serial")
    assert report.exit_code == 0
    return folder


@pytest.fixture
def ready(made, tmp_path):
    """The jobs and the output folder, to be changed at will."""
    folder = shutil.copytree(made, tmp_path / "copy")
    tracks = (Track(1, "thing", (Keyframe(0, BoundingBox(8, 8, 24, 24)),)),)
    return [VideoJob(name, folder / f"{name}.mp4", tracks) for name in "abc"], folder / "out"


def reasons(jobs, output, recipe=RECIPE, **options):
    return [reason for _, reason in planned_batch(jobs, output, recipe, **options)]


def again(jobs, output, recipe=RECIPE, **options):
    """Run again; the ids of the videos that were worked on."""
    events = []
    annotate_batch(jobs, output, recipe, executor="serial", on_event=events.append, **options)
    return [event["video"] for event in events if event["event"] == "started"]


def test_what_is_up_to_date_is_left_alone(ready):
    jobs, output = ready
    before = {path: path.stat().st_mtime_ns for path in output.glob("*/*")}
    assert reasons(jobs, output) == [None] * 3
    assert again(jobs, output) == []
    assert {path: path.stat().st_mtime_ns for path in output.glob("[abc]/*")}.items() <= (
        before.items()
    )


def test_everything_is_done_when_asked_for(ready):
    jobs, output = ready
    assert again(jobs, output, fresh=True) == ["a", "b", "c"]


def test_other_boxes_are_a_reason(ready):
    jobs, output = ready
    track = Track(1, "thing", (Keyframe(1, BoundingBox(8, 8, 24, 24)),))
    jobs[1] = replace(jobs[1], tracks=(track,))
    assert reasons(jobs, output) == [None, "its boxes in the manifest have changed", None]
    assert again(jobs, output) == ["b"]
    assert reasons(jobs, output) == [None] * 3


def test_the_same_boxes_in_decimals_are_no_reason(ready):
    jobs, output = ready
    track = Track(1, "thing", (Keyframe(0, BoundingBox(8.0, 8.0, 24.0, 24.0)),))
    assert reasons([replace(job, tracks=(track,)) for job in jobs], output) == [None] * 3


def test_another_recipe_is_a_reason_that_is_named(ready):
    jobs, output = ready
    other = load_recipe("csv_only", ["tracker.learning_rate=0.02", "mot.pixel_origin=1"])
    said = "the recipe has changed: tracker.learning_rate and 1 more settings"
    assert reasons(jobs, output, other) == [said] * 3


def test_another_version_is_a_reason(ready):
    jobs, output = ready
    path = output / "c" / "summary.json"
    summary = json.loads(path.read_text())
    summary["versions"]["situp-annotate"] = "0.0.1"
    path.write_text(json.dumps(summary))
    assert reasons(jobs, output) == [None, None, "it was made by version 0.0.1"]


@pytest.mark.parametrize(
    ("lost", "reason"),
    [
        ("labels.csv", "labels.csv is missing"),
        ("summary.json", "summary.json is missing"),
        (".", "it is not done yet"),
    ],
)
def test_what_is_missing_is_made_again(ready, lost, reason):
    jobs, output = ready
    path = output / "a" / lost
    shutil.rmtree(path) if path.is_dir() else path.unlink()
    assert reasons(jobs, output) == [reason, None, None]
    assert again(jobs, output) == ["a"]
    assert (output / "a" / "labels.csv").exists()


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"outputs": 3}', '{"recipe": {"mot": 1}}'])
def test_a_summary_that_is_none_is_made_again(ready, content):
    jobs, output = ready
    (output / "b" / "summary.json").write_text(content)
    assert again(jobs, output) == ["b"]


def test_a_video_with_other_content_is_done_again_and_one_that_was_only_touched_is_not(ready):
    jobs, output = ready
    os.utime(jobs[0].path, ns=(1, 1))
    write_video(jobs[1].path, count=5)
    untouched = (output / "a" / "summary.json").stat().st_mtime_ns
    assert reasons(jobs, output)[2] is None
    assert all("touched" in reason for reason in reasons(jobs, output)[:2])
    assert sorted(again(jobs, output)) == ["a", "b"]
    assert (output / "a" / "summary.json").stat().st_mtime_ns == untouched
    assert json.loads((output / "b" / "summary.json").read_text())["frames"] == 5
    assert reasons(jobs, output) == [None] * 3


def test_without_the_journal_contents_are_compared(ready):
    jobs, output = ready
    shutil.rmtree(output / ".run")
    shutil.rmtree(output / "logs")
    (output / "batch.json").unlink()
    assert all("touched" in reason for reason in reasons(jobs, output))
    before = (output / "a" / "labels.csv").stat().st_mtime_ns
    again(jobs, output)
    assert (output / "a" / "labels.csv").stat().st_mtime_ns == before


def test_a_video_that_failed_is_tried_again(ready):
    jobs, output = ready
    content = jobs[0].path.read_bytes()
    jobs[0].path.unlink()
    assert reasons(jobs, output) == ["the video cannot be read", None, None]
    assert again(jobs, output) == ["a"]
    assert (output / "a" / "labels.csv").exists()  # what was made before is not lost
    assert reasons(jobs, output)[0] == "it failed (missing)"
    jobs[0].path.write_bytes(content)
    assert again(jobs, output) == ["a"]
    assert reasons(jobs, output) == [None] * 3


def test_a_folder_of_pictures_has_a_stamp_too(tmp_path):
    (tmp_path / "img").mkdir()
    for number in range(3):
        (tmp_path / "img" / f"{number}.png").write_bytes(b"x" * number)
    first = stamp_of(tmp_path)
    assert first[0] == 3
    (tmp_path / "img" / "1.png").write_bytes(b"yy")
    assert stamp_of(tmp_path) != first
    assert stamp_of(tmp_path / "none") is None


def test_longest_videos_come_first(ready):
    jobs, output = ready
    jobs = [replace(job, frame_count_hint=count) for job, count in zip(jobs, (5, 50, 7))]  # noqa: B905
    assert again(jobs, output, fresh=True) == ["b", "c", "a"]
