"""The report of a batch says what became of its videos."""

import json
import re

import pytest
from support.patch import patch_job, write_patch

from situp_annotate.batch import annotate_batch
from situp_annotate.overview import overview_html
from situp_annotate.recipe import load_recipe

REPORT_ONLY = ["outputs.mcap=false", "outputs.overlay=false"]


@pytest.fixture(scope="module")
def jobs(tmp_path_factory):
    clip = write_patch(tmp_path_factory.mktemp("clips") / "patch.mp4")
    return [
        patch_job(clip, 0, 99, video_id="late"),
        patch_job(clip.with_name("gone.mp4"), 0, video_id="gone"),
        patch_job(clip, 0, 11, video_id="good"),
    ]


@pytest.fixture(scope="module")
def done(jobs, tmp_path_factory):
    output = tmp_path_factory.mktemp("out")
    return annotate_batch(
        jobs, output, load_recipe("situp", REPORT_ONLY), executor="serial"
    ), output


def test_rows_say_what_the_summaries_say(done):
    batch, output = done
    html = (output / "report.html").read_text(encoding="utf-8")
    assert html == overview_html(batch.outcomes)
    data = json.loads(re.findall(r'type="application/json">(.*?)</script>', html)[0])
    rows = {video["id"]: video for video in data["videos"]}
    assert set(rows) == {"late", "good"}
    (failure,) = batch.failures
    assert failure.message in html
    for outcome in batch.outcomes:
        if outcome == failure:
            continue
        (track,) = outcome.tracks
        ((id_, label, gain, suggestions, profile, mean, frames, *counts),) = rows[outcome.id][
            "tracks"
        ]
        assert (id_, label, suggestions) == (track.id, track.label, len(track.review))
        assert gain == pytest.approx(sum(each.gain for each in track.review), abs=0.05)
        assert (profile, frames) == (track.profile, [track.first_frame, track.last_frame])
        assert mean == pytest.approx(track.mean_confidence, abs=0.001)
        boxes = track.human_boxes + track.propagated_boxes
        assert counts == [boxes, track.human_boxes, track.tracked_boxes, 0, 0]
        assert rows[outcome.id]["values"][-1] == len(outcome.skipped) + len(outcome.findings)


def test_skipped_keyframes_are_notes(done):
    batch, output = done
    (skip,) = batch.outcomes[0].skipped
    assert skip.frame == 99
    assert skip.reason in (output / "report.html").read_text(encoding="utf-8")
    assert skip.reason in (output / "late" / "report.html").read_text(encoding="utf-8")


def test_the_page_of_a_video_without_an_overlay_says_so(done):
    html = (done[1] / "good" / "report.html").read_text(encoding="utf-8")
    assert "outputs.overlay=true" in html


def test_no_report_is_written_unless_the_recipe_asks_for_it(jobs, tmp_path):
    annotate_batch(jobs, tmp_path, load_recipe("csv_only"), executor="serial")
    assert list(tmp_path.rglob("report.html")) == []
