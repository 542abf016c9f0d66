"""Labels are the same with the cache, and what has not changed is not done again."""

import shutil
from dataclasses import replace

import pytest
from support.media import truncate
from support.patch import keyframe_at, patch_job, write_patch

from situp_annotate import pipeline
from situp_annotate.cache import VideoCache
from situp_annotate.errors import VideoError
from situp_annotate.formats.mot.rows import read_mot
from situp_annotate.outcomes import CacheUse
from situp_annotate.pipeline import annotate_video
from situp_annotate.propagation import PassKey
from situp_annotate.recipe import load_recipe
from situp_annotate.types import BoundingBox, Keyframe
from situp_annotate.video import footage

COUNT = 36
KEYFRAMES = (0, 8, 16, 24)
PASSES = 4 + 3
CSV_ONLY = load_recipe("csv_only")


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    return write_patch(tmp_path_factory.mktemp("clips") / "patch.mp4", COUNT)


@pytest.fixture(scope="module")
def first(clip, tmp_path_factory):
    """Output of a first run."""
    output = tmp_path_factory.mktemp("first")
    report = annotate_video(patch_job(clip, *KEYFRAMES), output, CSV_ONLY)
    assert report.cache == CacheUse(PASSES, 0)
    return output


@pytest.fixture
def output(first, tmp_path):
    """A copy of it to work on."""
    return shutil.copytree(first, tmp_path / "out")


def again(job, output, recipe=CSV_ONLY, **options):
    return annotate_video(job, output, recipe, overwrite=True, **options)


def kept(output):
    return sorted((output / ".cache" / "patch").iterdir())


def mot_csv(output):
    return (output / "patch" / "mot.csv").read_bytes()


def test_a_file_for_each_pass_and_one_for_the_walk(output):
    names = [path.name.partition("-")[0] for path in kept(output)]
    assert names == ["pass"] * PASSES + ["walk"]


def test_without_a_change_nothing_is_decoded_or_tracked(clip, output, monkeypatch):
    def fail(*_, **__):
        raise AssertionError("opened again")

    before, files = mot_csv(output), kept(output)
    monkeypatch.setattr(footage, "open_video", fail)
    monkeypatch.setattr(footage, "Rewinder", fail)
    report = again(patch_job(clip, *KEYFRAMES), output)
    assert report.cache == CacheUse(PASSES, PASSES)
    assert (report.frames, report.video.path) == (COUNT, clip)
    assert mot_csv(output) == before
    assert kept(output) == files


def test_without_the_cache_nothing_is_read_or_written_and_labels_are_the_same(
    clip, output, tmp_path
):
    job = patch_job(clip, *KEYFRAMES)
    before = {path: path.stat().st_mtime_ns for path in kept(output)}
    report = again(job, output, cache=False)
    assert report.cache == CacheUse(PASSES, 0)
    assert {path: path.stat().st_mtime_ns for path in kept(output)} == before
    annotate_video(job, tmp_path / "fresh", CSV_ONLY, cache=False)
    assert mot_csv(tmp_path / "fresh") == mot_csv(output)
    assert [path.name for path in (tmp_path / "fresh").iterdir()] == ["patch"]


def rows_outside(output, first, last):
    rows = read_mot(output / "patch" / "mot.csv")
    return [row for row in rows if not first < row.frame < last]


def with_keyframe(job, keyframe):
    """The job with one keyframe more, or in the place of another."""
    (track,) = job.tracks
    others = [each for each in track.keyframes if each.frame != keyframe.frame]
    keyframes = sorted([*others, keyframe], key=lambda each: each.frame)
    return replace(job, tracks=(replace(track, keyframes=tuple(keyframes)),))


@pytest.mark.parametrize(
    ("keyframe", "first_frame", "last_frame", "passes", "made"),
    [
        (keyframe_at(12), 8, 16, PASSES + 2, 4),
        # The pass toward the corrected box starts from the same box, and ends in the same frame.
        (Keyframe(16, BoundingBox(54, 42, 22, 22)), 8, 24, PASSES, 2),
        (keyframe_at(30), 24, COUNT, PASSES + 2, 3),
    ],
)
def test_a_correction_changes_the_spans_beside_it_and_no_other(
    clip, output, tmp_path, keyframe, first_frame, last_frame, passes, made
):
    job = with_keyframe(patch_job(clip, *KEYFRAMES), keyframe)
    before = mot_csv(output)
    untouched = [
        row for row in rows_outside(output, first_frame, last_frame) if row.frame != keyframe.frame
    ]
    report = again(job, output)
    assert report.cache == CacheUse(passes, passes - made)
    assert mot_csv(output) != before
    after = rows_outside(output, first_frame, last_frame)
    assert [row for row in after if row.frame != keyframe.frame] == untouched
    annotate_video(job, tmp_path / "fresh", CSV_ONLY, cache=False)
    assert mot_csv(tmp_path / "fresh") == mot_csv(output)


def test_what_a_run_does_not_use_is_deleted(clip, output):
    (output / ".cache" / "patch" / ".pass-1.npz.partial").touch()
    report = again(patch_job(clip, 0), output)
    assert report.cache == CacheUse(1, 0)
    assert [path.name.partition("-")[0] for path in kept(output)] == ["pass", "walk"]


def damage(path, how):
    content = path.read_bytes()
    if how == "cut":
        path.write_bytes(content[: len(content) // 2])
    elif how == "flipped":
        middle = len(content) // 2
        path.write_bytes(content[:middle] + bytes([content[middle] ^ 255]) + content[middle + 1 :])
    elif how == "folder":
        path.unlink()
        path.mkdir()
    else:
        path.write_bytes(b"")


@pytest.mark.parametrize("how", ["cut", "flipped", "empty", "folder"])
def test_damaged_files_are_as_good_as_none(clip, output, how):
    before = mot_csv(output)
    for path in kept(output):
        damage(path, how)
    report = again(patch_job(clip, *KEYFRAMES), output)
    assert report.cache == CacheUse(PASSES, 0)
    assert mot_csv(output) == before


def test_files_in_each_others_place_are_not_believed(clip, output):
    before = mot_csv(output)
    *passes, walk = kept(output)
    content = passes[0].read_bytes()
    passes[0].write_bytes(walk.read_bytes())
    walk.write_bytes(content)
    report = again(patch_job(clip, *KEYFRAMES), output)
    assert report.cache == CacheUse(PASSES, PASSES - 1)
    assert mot_csv(output) == before


def test_passes_belong_to_the_trackers_settings(clip, output):
    recipe = load_recipe("csv_only", ["tracker.learning_rate=0.01"])
    assert again(patch_job(clip, *KEYFRAMES), output, recipe).cache.reused == 0
    recipe = load_recipe(
        "csv_only", ["tracker.learning_rate=0.01", "propagation.direction=forward"]
    )
    assert again(patch_job(clip, *KEYFRAMES), output, recipe).cache == CacheUse(4, 4)


def test_a_colour_table_counts_by_its_content(tmp_path):
    table = tmp_path / "table.txt"
    params = replace(CSV_ONLY.tracker, color_table=str(table))
    table.write_text("one")
    places = [VideoCache(None, "0", params, {})]
    table.write_text("two")
    places.append(VideoCache(None, "0", params, {}))
    key = PassKey(3, BoundingBox(1, 2, 3, 4), None, True)
    assert len({place.passes.name(key) for place in places}) == 2


def test_passes_belong_to_the_versions(clip, output, monkeypatch):
    versions = pipeline.versions() | {"numpy": "0.1"}
    monkeypatch.setattr(pipeline, "versions", lambda: versions)
    assert again(patch_job(clip, *KEYFRAMES), output).cache.reused == 0


def test_passes_belong_to_the_video(output, tmp_path):
    other = write_patch(tmp_path / "patch.mp4", COUNT - 1)
    report = again(patch_job(other, *KEYFRAMES), output)
    assert (report.cache.reused, report.frames) == (0, COUNT - 1)


def test_a_video_that_moves_keeps_its_passes(clip, output, tmp_path):
    moved = shutil.copy(clip, tmp_path / "moved.mp4")
    report = again(patch_job(moved, *KEYFRAMES), output)
    assert report.cache == CacheUse(PASSES, PASSES)
    assert report.video.path == moved


def test_a_video_that_fails_leaves_no_cache(clip, tmp_path):
    cut = truncate(clip, tmp_path / "cut.mp4", 0.5)
    with pytest.raises(VideoError):
        annotate_video(patch_job(cut, *KEYFRAMES), tmp_path / "out", CSV_ONLY)
    assert list((tmp_path / "out").iterdir()) == []


def test_findings_and_times_come_from_the_cache_too(tmp_path):
    whole = write_patch(tmp_path / "whole.mkv", COUNT)
    cut = truncate(whole, tmp_path / "cut.mkv", 0.7)
    recipe = load_recipe("csv_only", ["decoding.incomplete=keep", "outputs.mcap=true"])
    job = patch_job(cut, 0, 8)
    reports = [again(job, tmp_path / "out", recipe) for _ in range(2)]
    assert reports[0].findings == reports[1].findings != ()
    assert reports[0].video == reports[1].video
    assert reports[1].cache == CacheUse(3, 3)


def test_what_cannot_be_written_is_done_without(clip, tmp_path):
    (tmp_path / ".cache").write_text("in the way")
    report = annotate_video(patch_job(clip, *KEYFRAMES), tmp_path, CSV_ONLY)
    assert report.cache == CacheUse(PASSES, 0)
    assert (tmp_path / ".cache").read_text() == "in the way"


def test_progress_counts_what_is_left_to_do(clip, output):
    seen = []
    job = with_keyframe(patch_job(clip, *KEYFRAMES), keyframe_at(12))
    again(job, output, on_progress=lambda *step: seen.append(step))
    # Forward to frame 16, and backward from there to 8.
    assert seen == [(done, 17 + 9) for done in range(1, 17 + 9 + 1)]
    seen.clear()
    again(job, output, on_progress=lambda *step: seen.append(step))
    assert seen == [(0, 0)]
