"""Many videos at once: each is an outcome of its own."""

import json
import os
import signal
import subprocess
import sys
import time
from functools import partial

import pytest
from support.media import truncate, write_av1, write_empty_video, write_video

from situp_annotate.batch import annotate_batch
from situp_annotate.errors import OutputError
from situp_annotate.formats.manifest import dump_manifest
from situp_annotate.outcomes import CacheUse, VideoReport
from situp_annotate.recipe import load_recipe
from situp_annotate.types import BoundingBox, Keyframe, Track, VideoJob

CSV_ONLY = ["--recipe", "csv_only"]


def job_of(path, *, frames=(0,)):
    track = Track(1, "thing", tuple(Keyframe(n, BoundingBox(8, 8, 24, 24)) for n in frames))
    return VideoJob(path.stem, path, (track,))


@pytest.fixture(scope="module")
def clips(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clips")
    counts = {"a": 8, "b": 12, "c": 16}
    return [write_video(folder / f"{name}.mp4", count=count) for name, count in counts.items()]


@pytest.fixture(scope="module")
def damaged(tmp_path_factory):
    """One of every kind that a folder of real videos holds, and one good."""
    folder = tmp_path_factory.mktemp("damaged")
    write_video(folder / "good.mp4", count=12)
    faststart = {"movflags": "+faststart"}
    whole = write_video(folder / "whole.mp4", count=60, gop=1, container_options=faststart)
    truncate(whole, folder / "truncated.mp4", 0.6)
    whole.unlink()
    write_av1(folder / "av1.mp4", count=12)
    (folder / "text.mp4").write_text("I am no video.\n" * 50)
    write_empty_video(folder / "empty.mp4")
    names = ("good", "truncated", "av1", "text", "missing", "empty")
    return [job_of(folder / f"{name}.mp4") for name in names]


def contents(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.name in {"mot.csv", "annotations.mcap"}
    }


def test_one_bad_video_never_costs_another(damaged, tmp_path):
    report = annotate_batch(damaged, tmp_path / "out")
    outcomes = {outcome.id: outcome for outcome in report.outcomes}
    assert list(outcomes) == [job.id for job in damaged]
    kinds = {failure.id: failure.kind for failure in report.failures}
    assert kinds == {
        "truncated": "incomplete",
        "text": "not_a_video",
        "missing": "missing",
        "empty": "no_frames",
    }
    for id_ in kinds:
        assert f"{id_}.mp4" in outcomes[id_].message
    assert outcomes["good"].frames == outcomes["av1"].frames == 12
    assert report.exit_code == 1
    left = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert left == [".cache", ".run", "av1", "batch.json", "good", "logs", "report.html"]
    for name in ("av1", "good"):
        assert (tmp_path / "out" / name / "overlay.mp4").stat().st_size > 1000


def test_batch_json_tells_all(damaged, tmp_path):
    report = annotate_batch(damaged, tmp_path, load_recipe("csv_only"), executor="serial")
    written = json.loads((tmp_path / "batch.json").read_text())
    videos = written.pop("videos")
    assert written == json.loads(json.dumps(report.as_dict()))
    assert [VideoReport.from_dict(video) for video in videos if video["status"] == "ok"] == [
        outcome for outcome in report.outcomes if isinstance(outcome, VideoReport)
    ]
    assert (written["succeeded"], written["failed"], written["interrupted"]) == (2, 4, False)
    assert [video["status"] for video in videos] == [
        "ok", "failed", "ok", "failed", "failed", "failed",
    ]  # fmt: skip


def test_results_do_not_depend_on_the_number_of_workers(clips, tmp_path):
    jobs = [job_of(clip, frames=(0, 6)) for clip in clips]
    annotate_batch(jobs, tmp_path / "serial", executor="serial")
    annotate_batch(jobs, tmp_path / "one", workers=1)
    annotate_batch(jobs, tmp_path / "three", workers=3)
    reference = contents(tmp_path / "serial")
    assert len(reference) == 6
    assert contents(tmp_path / "one") == reference
    assert contents(tmp_path / "three") == reference


def test_progress_ends_with_every_frame(clips, tmp_path):
    seen = []
    annotate_batch(
        [job_of(clip) for clip in clips], tmp_path, load_recipe("csv_only"), on_progress=seen.append
    )
    assert (seen[-1].videos_done, seen[-1].videos) == (3, 3)
    assert seen[-1].frames_done == seen[-1].frames_expected == 8 + 12 + 16
    assert seen[-1].running == ()


def test_what_no_run_has_written_stops_the_batch_before_any_work(clips, tmp_path):
    job = job_of(clips[0])
    for name in ("report.html", "batch.json", "logs"):
        folder = tmp_path / name
        folder.mkdir()
        (folder / name).touch()
        with pytest.raises(OutputError, match="not of a run"):
            annotate_batch([job], folder)
        assert [path.name for path in folder.iterdir()] == [name]
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="must be a folder"):
        annotate_batch([job], tmp_path / "file")


def test_what_somebody_put_into_the_folder_of_a_video_stays(clips, tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "notes.txt").write_text("mine")
    report = annotate_batch([job_of(clip) for clip in clips[:2]], tmp_path, load_recipe("csv_only"))
    assert [(failure.id, failure.kind) for failure in report.failures] == [("a", "output")]
    assert (tmp_path / "a" / "notes.txt").read_text() == "mine"


def test_fresh_does_all_anew_and_does_not_track_again(clips, tmp_path):
    recipe = load_recipe("csv_only")
    for cache, reused in ((False, 0), (True, 0), (True, 1), (False, 0)):
        report = annotate_batch([job_of(clips[0])], tmp_path, recipe, fresh=True, cache=cache)
        assert report.exit_code == 0
        assert report.outcomes[0].cache == CacheUse(1, reused)


def test_a_video_that_crashes_its_process_is_one_outcome(clips, tmp_path):
    """A decoder that dies for real: the first worker to see the video is killed."""
    script = tmp_path / "crash.py"
    jobs = [job_of(clip) for clip in clips]
    script.write_text(
        "import os, signal\n"
        "from pathlib import Path\n"
        "import situp_annotate.video.footage as footage\n"
        "import situp_annotate.batch as batch\n"
        "from situp_annotate.recipe import load_recipe\n"
        "from tests_jobs import JOBS\n"
        "real = footage.open_video\n"
        "def deadly(path, **options):\n"
        "    if path.stem == 'b':\n"
        "        os.kill(os.getpid(), signal.SIGSEGV)\n"
        "    return real(path, **options)\n"
        "footage.open_video = deadly\n"
        "if __name__ == '__main__':\n"
        f"    out, recipe = {str(tmp_path / 'out')!r}, load_recipe('csv_only')\n"
        "    report = batch.annotate_batch(JOBS, out, recipe)\n"
        "    print([(o.id, getattr(o, 'kind', 'ok')) for o in report.outcomes])\n"
    )
    (tmp_path / "tests_jobs.py").write_text(
        f"from pathlib import PosixPath\nfrom situp_annotate.types import *\nJOBS = {jobs!r}\n"
    )
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[('a', 'ok'), ('b', 'crashed'), ('c', 'ok')]"
    assert "SIGSEGV" in (tmp_path / "out" / "batch.json").read_text()
    left = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert left == [".cache", ".run", "a", "batch.json", "c", "logs"]
    assert (
        "Fatal Python error: Segmentation fault"
        in (tmp_path / "out" / "logs" / "b.log").read_text()
    )


def run_command(*arguments, **options):
    command = [sys.executable, "-m", "situp_annotate", "run", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, **options)


def manifest_of(jobs, folder, name="manifest.json"):
    path = folder / name
    path.write_text(dump_manifest(jobs, folder))
    return path


def test_command_ends_with_a_table_and_its_exit_code(damaged, tmp_path):
    folder = damaged[0].path.parent
    manifest = manifest_of(damaged, folder)
    done = run_command(manifest, "--output", tmp_path / "out", *CSV_ONLY)
    assert done.returncode == 1, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].split() == [
        "video", "status", "frames", "frames/s", "tracks", "boxes", "lost", "confidence",
        "review", "notes",
    ]  # fmt: skip
    assert lines[1].split()[:3] == ["good", "ok", "12"]
    assert "failed: incomplete" in lines[2]
    assert lines[-1].startswith("2 of 6 videos annotated")
    assert "%|" not in done.stderr  # no progress bar where there is no terminal
    good = manifest_of(damaged[:1], folder, "good.json")
    assert run_command(good, "--output", tmp_path / "good", *CSV_ONLY).returncode == 0
    again = run_command(good, "--output", tmp_path / "good", *CSV_ONLY)
    assert (again.returncode, again.stderr) == (0, "")
    assert "(1 were up to date)" in again.stdout


def test_command_refuses_bad_recipes(damaged, tmp_path):
    manifest = manifest_of(damaged[:1], damaged[0].path.parent)
    done = run_command(manifest, "--output", tmp_path / "out", "--set", "tracker.padding=0")
    assert (done.returncode, done.stdout) == (4, "")
    assert "padding = 0.0 is not allowed" in done.stderr
    assert not (tmp_path / "out").exists()


def group_vanishes(group):
    """Whether every process of a group is gone, given a moment for those that see their end."""
    for _ in range(100):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_interrupt_keeps_what_is_complete_and_leaves_no_process(tmp_path):
    clip = write_video(tmp_path / "long.mp4", count=1500, size_hw=(240, 320))
    short = write_video(tmp_path / "short.mp4", count=3)
    manifest = manifest_of([job_of(short), job_of(clip)], tmp_path)
    output = tmp_path / "out"
    command = [sys.executable, "-m", "situp_annotate", "run", str(manifest), "-o", str(output)]
    with subprocess.Popen(
        command,
        start_new_session=True,
        stderr=subprocess.PIPE,
        # Started in the background, these tests would hand on that Ctrl-C is to be ignored.
        preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),
    ) as process:
        for _ in range(600):
            if (output / "short").exists() and (output / ".long.partial").exists():
                break
            time.sleep(0.1)
        os.killpg(process.pid, signal.SIGINT)
        _, stderr = process.communicate(timeout=60)
    assert process.returncode == 130, stderr
    assert b"Interrupted: 1 of 2 videos are complete in" in stderr
    assert f"Go on with: situp-annotate run {manifest} -o {output}" in stderr.decode()
    assert sorted(path.name for path in output.iterdir()) == [
        ".cache", ".run", "batch.json", "logs", "report.html", "short",
    ]  # fmt: skip
    assert "interrupted" in (output / "report.html").read_text()
    written = json.loads((output / "batch.json").read_text())
    assert written["interrupted"]
    assert [video["id"] for video in written["videos"]] == ["short"]
    assert group_vanishes(process.pid)


def test_reports_are_values(clips, tmp_path):
    report = annotate_batch([job_of(clips[0])], tmp_path, load_recipe("csv_only"), workers=1)
    (outcome,) = report.outcomes
    assert isinstance(outcome, VideoReport)
    assert report.workers == 1
