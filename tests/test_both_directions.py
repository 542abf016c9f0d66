"""Labels between, before and without keyframes, through the whole pipeline."""

import csv
import json
from dataclasses import replace
from fractions import Fraction

import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from support.media import truncate, write_video
from support.patch import STEP, box_at, keyframe_at, moving, patch_job, write_patch

from situp_annotate import writing
from situp_annotate.errors import VideoError
from situp_annotate.formats.mcap.log import TRACKS_TOPIC
from situp_annotate.formats.mot.rows import read_mot
from situp_annotate.pipeline import annotate_video
from situp_annotate.recipe import load_recipe
from situp_annotate.types import BoundingBox, Extend, Keyframe, Method, Track, VideoJob
from situp_annotate.video import footage

COUNT = 24


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    # Large, so that one megabyte holds no more than two pictures.
    folder = tmp_path_factory.mktemp("clips")
    return write_patch(folder / "patch.mp4", COUNT, (480, 640))


def csv_only(*settings):
    return load_recipe("csv_only", settings)


def rows_of(output):
    return read_mot(output / "patch" / "mot.csv")


def test_boxes_of_both_directions_follow_the_patch(clip, tmp_path):
    report = annotate_video(patch_job(clip, 0, 20), tmp_path, csv_only())
    rows = rows_of(tmp_path)
    assert [row.frame for row in rows] == list(range(COUNT))
    assert (rows[0].box, rows[20].box) == (box_at(0), box_at(20))
    for row in rows:
        assert row.box.x == pytest.approx(box_at(row.frame).x, abs=2)
        assert row.box.y == pytest.approx(40, abs=2)
    assert report.seconds["rewind"] > 0
    assert report.cache.passes == 3


@pytest.mark.parametrize("memory_mb", [1, 256])
@pytest.mark.parametrize("threads", [1, 2])
def test_labels_do_not_depend_on_memory_or_threads(clip, tmp_path, memory_mb, threads):
    job = patch_job(clip, 0, 9, 20)
    other = replace(job.tracks[0], id=2, keyframes=(keyframe_at(4), keyframe_at(16)))
    job = replace(job, tracks=(*job.tracks, other))
    annotate_video(job, tmp_path / "plain", csv_only())
    recipe = csv_only(f"propagation.memory_mb={memory_mb}")
    annotate_video(job, tmp_path / "other", recipe, threads=threads)
    written = [(tmp_path / name / "patch" / "mot.csv").read_bytes() for name in ("plain", "other")]
    assert written[0] == written[1]
    assert written[0].count(b"\n") == COUNT + 20


def test_nothing_is_read_backward_without_need(clip, tmp_path, monkeypatch):
    def fail(*_, **__):
        raise AssertionError("read backward")

    monkeypatch.setattr(footage, "Rewinder", fail)
    annotate_video(patch_job(clip, 3), tmp_path / "one", csv_only())
    forward = csv_only("propagation.direction=forward")
    report = annotate_video(patch_job(clip, 3, 20), tmp_path / "forward", forward)
    assert "rewind" not in report.seconds


def test_pictures_are_decoded_again_only_where_they_are_looked_at(clip, tmp_path, monkeypatch):
    def fail(*_, **__):
        raise AssertionError("decoded again")

    monkeypatch.setattr(writing, "open_video", fail)
    recipe = load_recipe("situp", ["outputs.overlay=false", "outputs.report=false"])
    report = annotate_video(patch_job(clip, 0), tmp_path, recipe)
    assert "annotations.mcap" in report.outputs
    with pytest.raises(AssertionError, match="decoded again"):
        annotate_video(patch_job(clip, 0), tmp_path / "again", load_recipe("overlay"))


@pytest.mark.parametrize("in_recipe", [True, False])
def test_a_track_can_extend_to_before_its_first_keyframe(clip, tmp_path, in_recipe):
    job = patch_job(clip, 12)
    recipe = csv_only("propagation.extend=both") if in_recipe else csv_only()
    if not in_recipe:
        job = replace(job, tracks=(replace(job.tracks[0], extend=Extend.BOTH),))
    report = annotate_video(job, tmp_path, recipe)
    rows = rows_of(tmp_path)
    assert [row.frame for row in rows] == list(range(COUNT))
    assert rows[0].box.x == pytest.approx(20, abs=3)
    assert (report.tracks[0].first_frame, report.cache.passes) == (0, 2)


def test_a_track_can_be_interpolated(clip, tmp_path):
    job = patch_job(clip, 4, 20)
    job = replace(job, tracks=(replace(job.tracks[0], method=Method.LINEAR),))
    report = annotate_video(job, tmp_path, csv_only())
    rows = rows_of(tmp_path)
    assert [row.frame for row in rows] == list(range(4, COUNT))
    assert [row.box.x for row in rows] == [20 + STEP * min(row.frame, 20) for row in rows]
    assert report.cache.passes == 0
    (track,) = report.tracks
    assert (track.human_boxes, track.tracked_boxes) == (2, 0)
    assert track.interpolated_boxes == COUNT - 4 - 2


def states_in_log(path):
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        messages = reader.iter_decoded_messages(topics=[TRACKS_TOPIC])
        return [{state.id: state for state in proto.states} for *_, proto in messages]


def test_an_object_that_is_outside_has_no_box_and_says_so(clip, tmp_path):
    keyframes = (keyframe_at(2), Keyframe(6, None), keyframe_at(15), Keyframe(20, None))
    job = VideoJob("patch", clip, (Track(1, "patch", keyframes),))
    recipe = load_recipe("situp", ["outputs.overlay=false"])
    annotate_video(job, tmp_path, recipe)
    assert [row.frame for row in rows_of(tmp_path)] == [*range(2, 6), *range(15, 20)]
    states = states_in_log(tmp_path / "patch" / "annotations.mcap")
    assert [frame for frame, of_frame in enumerate(states) if not of_frame] == [0, 1]
    outside = [n for n, of_frame in enumerate(states[2:], 2) if of_frame[1].state == "outside"]
    assert outside == [*range(6, 15), *range(20, COUNT)]
    assert not states[6][1].HasField("x")
    assert states[15][1].HasField("x")


def vanishing(count, hidden_from):
    """The patch, and then nothing but the ground."""
    for index, image in enumerate(moving(count)):
        if index >= hidden_from:
            image[:] = 110
        yield image


def test_lost_boxes_are_logged_but_stand_in_no_csv_unasked(tmp_path):
    clip = write_video(tmp_path / "patch.mp4", vanishing(40, 10), options={"crf": "12"})
    for name, setting in (("usual", ""), ("all", '["visible", "occluded", "lost"]')):
        settings = ["outputs.overlay=false", *([f"mot.states={setting}"] if setting else [])]
        report = annotate_video(patch_job(clip, 0), tmp_path / name, load_recipe("situp", settings))
    (track,) = report.tracks
    assert track.lost_frames > 10
    assert track.interpolated_boxes == track.lost_frames
    assert len(rows_of(tmp_path / "all")) == 40
    assert len(rows_of(tmp_path / "usual")) == 40 - track.lost_frames
    states = states_in_log(tmp_path / "usual" / "patch" / "annotations.mcap")
    assert len(states) == 40
    assert [of_frame[1].state for of_frame in states].count("lost") == track.lost_frames
    assert states[-1][1].HasField("x")


def test_a_keyframe_past_the_end_makes_the_one_before_it_the_last(clip, tmp_path):
    report = annotate_video(patch_job(clip, 0, COUNT + 5), tmp_path / "two", csv_only())
    annotate_video(patch_job(clip, 0), tmp_path / "one", csv_only())
    assert [skip.frame for skip in report.skipped] == [COUNT + 5]
    assert rows_of(tmp_path / "two") == rows_of(tmp_path / "one")


def test_findings_are_told_once(tmp_path):
    whole = write_video(
        tmp_path / "whole.mp4", moving(30), container_options={"movflags": "+faststart"}, gop=1
    )
    cut = truncate(whole, tmp_path / "cut.mp4", 0.6)
    recipe = load_recipe("situp", ["decoding.incomplete=keep"])
    report = annotate_video(patch_job(cut, 0, 4), tmp_path / "out", recipe)
    assert [finding.kind for finding in report.findings].count("incomplete") == 1


def test_a_video_that_shrinks_meanwhile_fails(clip, tmp_path, monkeypatch):
    short = write_patch(tmp_path / "short.mp4", 5, (480, 640))
    opened = writing.open_video
    monkeypatch.setattr(writing, "open_video", lambda _path, **options: opened(short, **options))
    with pytest.raises(VideoError, match="do not change a video"):
        annotate_video(patch_job(clip, 0), tmp_path / "out", load_recipe("overlay"))
    assert not (tmp_path / "out" / "patch").exists()


def walked(job, output, recipe):
    seen = []
    annotate_video(job, output, recipe, on_progress=lambda *step: seen.append(step))
    return seen


def test_progress_counts_every_walk(clip, tmp_path):
    job = patch_job(clip, 2, 11)
    plain = walked(job, tmp_path / "plain", csv_only())
    assert plain == [(done, COUNT + 10) for done in range(1, COUNT + 11)]
    drawn = walked(job, tmp_path / "drawn", load_recipe("overlay"))
    assert drawn == [(done, 2 * COUNT + 10) for done in range(1, 2 * COUNT + 11)]


def test_progress_reaches_its_end_where_the_header_says_nothing(tmp_path):
    clip = write_video(tmp_path / "patch.mkv", moving(12), container_format="matroska")
    seen = walked(patch_job(clip, 0, 8), tmp_path / "out", csv_only())
    assert seen[-1] == (12 + 9, 12 + 9)
    assert all(total is None or total >= done for done, total in seen)


def test_review_ranks_the_frames_of_all_tracks(tmp_path):
    clip = write_video(tmp_path / "patch.mp4", vanishing(50, 10), options={"crf": "12"}, rate=25)
    job = patch_job(clip, 0)
    second = replace(job.tracks[0], id=2, label='a "patch", too')
    report = annotate_video(replace(job, tracks=(*job.tracks, second)), tmp_path, csv_only())
    with (tmp_path / "patch" / "review.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == [
        "rank", "track_id", "label", "frame", "time_s", "reason", "confidence", "gain",
    ]  # fmt: skip
    assert [row["rank"] for row in rows] == [str(rank) for rank in range(1, len(rows) + 1)]
    gains = [float(row["gain"]) for row in rows]
    assert gains == sorted(gains, reverse=True)
    assert {row["label"] for row in rows} == {"patch", 'a "patch", too'}
    assert rows[0]["reason"] == "target lost"
    for row in rows:
        assert Fraction(row["time_s"]) == Fraction(int(row["frame"]), 25)
    summary = json.loads((tmp_path / "patch" / "summary.json").read_text())
    told = [each for track in summary["tracks"] for each in track["review"]]
    assert len(told) == len(rows) == sum(len(track.review) for track in report.tracks)


def test_nothing_to_review_leaves_a_header(clip, tmp_path):
    job = VideoJob("patch", clip, (Track(1, "p", (Keyframe(0, BoundingBox(-90, 0, 9, 9)),)),))
    annotate_video(job, tmp_path, csv_only())
    assert (tmp_path / "patch" / "review.csv").read_text().count("\n") == 1
