"""What a run has written is read back as it was."""

import dataclasses
import json
import math

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


@pytest.mark.parametrize("name", ["summary.json", "manifest.json", "labels.csv"])
def test_a_missing_file_is_named(tmp_path, out, job, name):
    for path in (out / job.id).iterdir():
        if path.name != name:
            (tmp_path / path.name).write_bytes(path.read_bytes())
    with pytest.raises(SitupError, match=name):
        read_video(tmp_path)


def test_a_strange_summary_is_refused(tmp_path, out, job):
    for path in (out / job.id).iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "summary.json").write_text(json.dumps({"frames": "many"}))
    with pytest.raises(SitupError, match="not what `situp-annotate run` writes"):
        read_video(tmp_path)
