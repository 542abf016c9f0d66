"""What a run has written is read back as it was."""

import dataclasses
import json
import math
import shutil
from pathlib import Path

import pytest
from support.patch import patch_job, write_patch

from situp_annotate.batch import annotate_batch
from situp_annotate.errors import SitupError
from situp_annotate.recipe import load_recipe
from situp_annotate.results import read_run, read_video, run_folders
from situp_annotate.types import BoundingBox, Keyframe, Provenance, State, Track

DRAWN = BoundingBox(20.123456789, 40, 24, 24)


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    path = write_patch(tmp_path_factory.mktemp("clips") / "patch.mp4")
    leaving = Track(7, "door, old", (Keyframe(2, DRAWN), Keyframe(4, None)), {"wood": "oak"})
    job = patch_job(path, 0)
    return dataclasses.replace(job, tracks=(leaving, *job.tracks))


@pytest.fixture(scope="module")
def out(job, tmp_path_factory):
    output = tmp_path_factory.mktemp("run")
    missing = dataclasses.replace(job, id="gone", path=job.path.with_name("gone.mp4"))
    annotate_batch([missing, job], output, load_recipe("csv_only"), executor="serial")
    return output


def test_a_run_is_read_back(out, job):
    (video,) = read_run(out)
    assert (video.id, video.frame_count, video.info.path) == (job.id, 12, job.path)
    assert (video.info.width, video.info.frame_rate) == (160, 30)
    leaving, patch = sorted(job.tracks, key=lambda track: -track.id)
    assert [labelled.track for labelled in video.tracks] == [patch, leaving]
    assert video.times_ns == {frame: pytest.approx(frame / 30 * 1e9, abs=1) for frame in range(12)}


def test_labels_come_back_to_the_digit_or_the_millionth(out):
    (video,) = read_run(out)
    patch, leaving = video.tracks
    assert list(patch.points) == list(range(12))
    assert list(leaving.points) == [2, 3]
    assert leaving.points[2].box == DRAWN
    assert leaving.points[2].provenance is Provenance.HUMAN
    assert leaving.points[3].state in State
    assert patch.points[5].apce is not None
    assert not math.isnan(patch.points[5].confidence)


def test_failed_videos_are_left_out(out, job):
    assert run_folders(out) == (out / job.id,)


def test_what_is_no_run_is_refused(tmp_path, out, job):
    with pytest.raises(SitupError, match="output folder of `situp-annotate run`"):
        list(read_run(tmp_path))
    (tmp_path / "batch.json").write_text("[]")
    with pytest.raises(SitupError, match="not what a run writes"):
        list(read_run(tmp_path))
    (tmp_path / "batch.json").write_text("{")
    with pytest.raises(SitupError, match="not valid JSON"):
        list(read_run(tmp_path))


@pytest.fixture
def copied(tmp_path, out, job):
    """The folder of the video, to be damaged."""
    return Path(shutil.copytree(out / job.id, tmp_path / job.id))


@pytest.mark.parametrize("name", ["summary.json", "manifest.json", "labels.csv"])
def test_a_missing_file_is_named(copied, name):
    (copied / name).unlink()
    with pytest.raises(SitupError, match=name):
        read_video(copied)


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("frames",), "many"),
        (("frames",), -1),
        (("frames",), 2**31),
        (("video",), None),
        (("video", "width"), 0),
        (("video", "width"), "wide"),
        (("video", "frame_rate"), "1/0"),
        (("video", "frame_rate"), "0"),
        (("video", "frame_rate"), 25),
        (("video", "frame_rate"), "1e999999999"),
    ],
)
def test_a_strange_summary_is_refused(copied, place, value):
    path = copied / "summary.json"
    summary = json.loads(path.read_text())
    owner = summary
    for key in place[:-1]:
        owner = owner[key]
    owner[place[-1]] = value
    path.write_text(json.dumps(summary))
    with pytest.raises(SitupError, match=r"summary\.json: .*not what `situp-annotate run` writes"):
        read_video(copied)


def test_labels_past_the_end_of_the_video_are_refused(copied):
    path = copied / "summary.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"frames": 11}))
    with pytest.raises(SitupError, match=r"labels\.csv: frame 11 has labels, but .* 11 frames"):
        read_video(copied)


def test_a_folder_with_the_labels_of_another_video_is_refused(copied):
    other = copied.rename(copied.with_name("other"))
    with pytest.raises(SitupError, match=r"manifest\.json: this is of the video 'patch', not"):
        read_video(other)


@pytest.mark.parametrize("ids", [["../out"], ["/etc"], [""], [3], [["a"]], ["a", "a"]])
def test_ids_that_name_no_folders_of_the_run_are_refused(tmp_path, ids):
    videos = [{"id": video_id, "status": "ok"} for video_id in ids]
    (tmp_path / "batch.json").write_text(json.dumps({"videos": videos}))
    with pytest.raises(SitupError, match=r"batch\.json: this is not what a run writes"):
        run_folders(tmp_path)


def test_json_that_is_nested_too_deeply_is_refused(tmp_path):
    (tmp_path / "batch.json").write_text("[" * 100_000)
    with pytest.raises(SitupError, match=r"batch\.json: this is not valid JSON"):
        run_folders(tmp_path)
