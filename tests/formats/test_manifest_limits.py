"""A manifest costs no more than its limits allow, however much it lies."""

import json
import os
import tracemalloc

import pytest

from situp_annotate.errors import ManifestError
from situp_annotate.formats.manifest import load_manifest
from situp_annotate.limits import Limits


def write(path, *tracks):
    path.write_text(json.dumps({"version": 1, "videos": [{"path": "a.mp4", "tracks": tracks}]}))
    return path


def problems(path, **limits):
    with pytest.raises(ManifestError) as caught:
        load_manifest(path, limits=Limits(**limits))
    return [line.removeprefix(f"{path}: ") for line in str(caught.value).splitlines()]


def track(track_id):
    return {"id": track_id, "label": "car", "frame": 0, "box": [1, 2, 3, 4]}


def test_as_many_tracks_as_are_allowed(tmp_path):
    path = write(tmp_path / "m.json", *map(track, range(1, 6)))
    (job,) = load_manifest(path, limits=Limits(max_tracks=5)).jobs
    assert len(job.tracks) == 5
    (problem,) = problems(path, max_tracks=4)
    assert problem.startswith("$.videos[0].tracks: 5 tracks are more than limits.max_tracks = 4")


def test_a_file_as_large_as_is_allowed(tmp_path):
    path = write(tmp_path / "m.json", track(1))
    path.write_text(path.read_text().ljust(2**20))
    assert load_manifest(path, limits=Limits(max_manifest_mb=1)).jobs
    path.write_text(path.read_text() + " ")
    (problem,) = problems(path, max_manifest_mb=1)
    assert "limits.max_manifest_mb = 1 allows" in problem


def test_a_file_without_end_is_not_read_to_its_end(tmp_path):
    with (tmp_path / "m.json").open("wb") as file:
        file.truncate(2**40)
    (problem,) = problems(tmp_path / "m.json", max_manifest_mb=1)
    assert "limits.max_manifest_mb" in problem


def test_a_pipe_keeps_nobody_waiting(tmp_path):
    os.mkfifo(tmp_path / "m.json")
    assert problems(tmp_path / "m.json") == ["a pipe, a socket or a device; give a manifest file."]


def video(**more):
    return {"version": 1, "videos": [{"path": "a", "tracks": [], **more}]}


MANY = 20_000
KEYS = {f"key {number}": 0 for number in range(MANY)}
KEYFRAMES = {"id": 1, "label": "a", "keyframes": [0] * MANY}
HOSTILE = {
    "videos": {"version": 1, "videos": [{}] * MANY},
    "tracks": video(tracks=[{}] * MANY),
    "keyframes": video(tracks=[KEYFRAMES]),
    "keys": video(**KEYS),
    "keys of info": video(info=KEYS),
    "keys of nothing": KEYS,
}


@pytest.mark.parametrize("what", HOSTILE)
def test_problems_without_end_cost_no_more_than_a_thousand(what, tmp_path):
    path = tmp_path / "m.json"
    path.write_text(json.dumps(HOSTILE[what]))
    problems(path)  # what is made but once
    tracemalloc.start()
    lines = problems(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert 1 <= len(lines) <= 51
    assert peak < 40 * path.stat().st_size + 2_000_000


def test_it_is_said_that_there_are_more_than_were_looked_for(tmp_path):
    path = tmp_path / "m.json"
    path.write_text(json.dumps({"version": 1, "videos": [{"path": 1, "tracks": []}] * 2000}))
    assert problems(path)[-1] == "and at least 950 more."


@pytest.mark.parametrize("document", ["NaN", "null", "[NaN]", '"\\ud800"'])
def test_a_document_that_is_one_slip(document, tmp_path):
    (tmp_path / "m.json").write_text(document)
    assert problems(tmp_path / "m.json")
