"""One video from the manifest's job to its outputs."""

import hashlib
import json

import av
import pytest
from mcap.reader import make_reader
from support.media import truncate, write_video
from support.patch import STEP, moving, patch_job, write_patch

from situp_annotate.errors import OutputError, VideoIncompleteError
from situp_annotate.formats.manifest import load_manifest
from situp_annotate.formats.mot.rows import read_mot
from situp_annotate.outcomes import CacheUse
from situp_annotate.pipeline import annotate_video
from situp_annotate.recipe import load_recipe
from situp_annotate.types import BoundingBox


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    return write_patch(tmp_path_factory.mktemp("clips") / "patch.mp4")


def job_of(path, *, frame=0):
    return patch_job(path, frame)


@pytest.fixture(scope="module")
def done(clip, tmp_path_factory):
    output = tmp_path_factory.mktemp("out")
    return annotate_video(job_of(clip), output), output / "patch"


def test_all_outputs_are_there_and_nothing_else(done):
    report, folder = done
    assert sorted(path.name for path in folder.iterdir()) == sorted(report.outputs)
    assert set(report.outputs) == {
        "annotations.layout.json", "annotations.mcap", "labels.csv", "manifest.json", "mot.csv",
        "overlay.mp4", "report.html", "review.csv", "summary.json",
    }  # fmt: skip
    assert sorted(path.name for path in folder.parent.iterdir()) == [".cache", "patch"]


def test_boxes_follow_the_patch(done):
    rows = read_mot(done[1] / "mot.csv")
    assert [row.frame for row in rows] == list(range(12))
    assert rows[0].box == BoundingBox(20, 40, 24, 24)
    for row in rows:
        assert row.box.x + row.box.width / 2 == pytest.approx(32 + STEP * row.frame, abs=3)


def test_every_output_has_every_frame_at_its_time(done, clip):
    with av.open(str(clip)) as source, av.open(str(done[1] / "overlay.mp4")) as overlay:
        times = [frame.time for frame in source.decode(video=0)]
        assert [frame.time for frame in overlay.decode(video=0)] == pytest.approx(times, abs=1e-4)
    with (done[1] / "annotations.mcap").open("rb") as stream:
        messages = make_reader(stream).iter_messages(topics=["/camera/annotations"])
        logged = [message.log_time / 1e9 for _, _, message in messages]
    assert logged == pytest.approx(times, abs=1e-6)


def test_summary_says_what_was_done(done, clip):
    summary = json.loads((done[1] / "summary.json").read_text())
    assert (summary["status"], summary["frames"]) == ("ok", 12)
    assert summary["sha256"] == hashlib.sha256(clip.read_bytes()).hexdigest()
    (track,) = summary["tracks"]
    assert track["attributes"] == {"colour": "many"}
    assert (track["human_boxes"], track["tracked_boxes"]) == (1, 11)
    assert (track["interpolated_boxes"], track["occluded_frames"], track["lost_frames"]) == (0,) * 3
    assert isinstance(track["review"], list)
    assert done[0].cache == CacheUse(1, 0)
    assert (track["first_frame"], track["last_frame"]) == (0, 11)
    assert 0 < track["mean_confidence"] <= 1
    assert summary["video"]["frame_rate"] == "30"
    assert {"hash", "open", "decode", "track", "review"} <= done[0].seconds.keys()
    assert {"mot.csv", "annotations.mcap", "overlay.mp4", "total"} <= done[0].seconds.keys()
    assert summary["recipe"]["tracker"]["learning_rate"] == 0.004
    assert {"python", "situp-annotate", "numpy"} <= set(summary["versions"])


def test_the_mcap_carries_a_manifest_that_runs_again(done, clip, tmp_path):
    with (done[1] / "annotations.mcap").open("rb") as stream:
        reader = make_reader(stream)
        attachments = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
        (metadata,) = list(reader.iter_metadata())
    assert attachments["mot.csv"] == (done[1] / "mot.csv").read_bytes()
    manifest = clip.parent / "again.json"
    manifest.write_bytes(attachments["manifest.json"])
    (job,) = load_manifest(manifest).jobs
    assert job.tracks == job_of(clip).tracks
    assert metadata.metadata["source_sha256"] == hashlib.sha256(clip.read_bytes()).hexdigest()
    assert metadata.metadata["frame_count"] == "12"


def test_recipe_chooses_the_outputs(clip, tmp_path):
    report = annotate_video(job_of(clip), tmp_path, load_recipe("csv_only"))
    always = {"labels.csv", "manifest.json", "review.csv", "summary.json"}
    assert set(report.outputs) == {*always, "mot.csv"}
    assert sorted(path.name for path in (tmp_path / "patch").iterdir()) == [*report.outputs]


def test_outputs_are_not_overwritten_unasked(clip, tmp_path):
    recipe = load_recipe("csv_only")
    annotate_video(job_of(clip), tmp_path, recipe)
    with pytest.raises(OutputError, match="--overwrite"):
        annotate_video(job_of(clip, frame=3), tmp_path, recipe)
    assert read_mot(tmp_path / "patch" / "mot.csv")[0].frame == 0
    annotate_video(job_of(clip, frame=3), tmp_path, recipe, overwrite=True)
    assert read_mot(tmp_path / "patch" / "mot.csv")[0].frame == 3


def test_truncated_video_fails_and_leaves_nothing_or_is_kept_on_request(tmp_path):
    whole = write_video(
        tmp_path / "whole.mp4", moving(30), container_options={"movflags": "+faststart"}, gop=1
    )
    cut = truncate(whole, tmp_path / "cut.mp4", 0.6)
    with pytest.raises(VideoIncompleteError, match="ends early"):
        annotate_video(job_of(cut), tmp_path / "out")
    assert list((tmp_path / "out").iterdir()) == []
    recipe = load_recipe("csv_only", ["decoding.incomplete=keep"])
    report = annotate_video(job_of(cut), tmp_path / "out", recipe)
    assert 5 < report.frames < 30
    assert "incomplete" in [finding.kind for finding in report.findings]


def test_keyframes_that_cannot_be_used_are_reported(clip, tmp_path):
    report = annotate_video(job_of(clip, frame=12), tmp_path, load_recipe("csv_only"))
    assert [skip.frame for skip in report.skipped] == [12]
    assert report.tracks[0].first_frame is None
    assert (tmp_path / "patch" / "mot.csv").read_text() == ""


def test_progress_is_told_after_each_frame(clip, tmp_path):
    seen = []
    annotate_video(
        job_of(clip), tmp_path, load_recipe("csv_only"), on_progress=lambda *step: seen.append(step)
    )
    assert [done for done, _ in seen] == list(range(1, 13))


def test_files_do_not_depend_on_threads(clip, tmp_path):
    for threads in (1, 3):
        annotate_video(job_of(clip), tmp_path / str(threads), threads=threads)
    one, three = (tmp_path / name / "patch" for name in ("1", "3"))
    for path in one.iterdir():
        assert path.read_bytes() == (three / path.name).read_bytes(), path.name


def test_an_overlay_of_what_is_doubtful(clip, tmp_path):
    rows = {}
    for below in (1.0, 0.0):
        recipe = load_recipe("overlay", [f"overlay.below={below}", "overlay.context=0"])
        annotate_video(job_of(clip), tmp_path / str(below), recipe)
        with av.open(str(tmp_path / str(below) / "patch" / "overlay.mp4")) as overlay:
            rows[below] = len(list(overlay.decode(video=0)))
    assert rows == {1.0: 11, 0.0: 12}  # all but the keyframe, and all
