"""``run``: its options, its table, and what it says to review first."""

import json
from dataclasses import replace
from functools import partial

import pytest
from click.testing import CliRunner
from support.patch import patch_job, write_patch

from situp_annotate.cli import cli
from situp_annotate.cli._table import summary_lines
from situp_annotate.formats.manifest import dump_manifest, load_manifest
from situp_annotate.outcomes import TrackSummary
from situp_annotate.pipeline import annotate_video
from situp_annotate.propagation import Reason, Suggestion
from situp_annotate.recipe import Recipe, load_recipe


@pytest.fixture(scope="module")
def manifest(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    job = patch_job(write_patch(folder / "patch.mp4"), 0, 8)
    path = folder / "manifest.json"
    path.write_text(dump_manifest([job], folder))
    return path


def run(manifest, output, *options):
    fixed = ["--output", str(output), "--recipe", "csv_only", "--executor", "serial"]
    return CliRunner().invoke(cli, ["run", str(manifest), *fixed, *options])


def cache_of(output):
    (video,) = json.loads((output / "batch.json").read_text())["videos"]
    return video["cache"]


def test_what_was_tracked_is_kept_unless_told_otherwise(manifest, tmp_path):
    outcome = run(manifest, tmp_path, "--no-cache")
    assert outcome.exit_code == 0, outcome.output
    assert not (tmp_path / ".cache").exists()
    first = (tmp_path / "patch" / "mot.csv").read_bytes()
    for reused in (0, 3):
        outcome = run(manifest, tmp_path, "--fresh")
        assert outcome.exit_code == 0, outcome.output
        assert cache_of(tmp_path) == {"passes": 3, "reused": reused}
        assert (tmp_path / "patch" / "mot.csv").read_bytes() == first
    run(manifest, tmp_path, "--fresh", "--no-cache")
    assert cache_of(tmp_path) == {"passes": 3, "reused": 0}


def test_a_second_run_finds_nothing_to_do(manifest, tmp_path):
    plan = run(manifest, tmp_path, "--dry-run")
    assert plan.output.splitlines() == [
        "patch: it is not done yet",
        "1 of 1 videos would be done, 0 are up to date.",
    ]
    assert not list(tmp_path.iterdir())
    assert run(manifest, tmp_path).exit_code == 0
    assert "0 of 1 videos would be done" in run(manifest, tmp_path, "--dry-run").output
    assert "1 of 1 videos annotated (1 were up to date)" in run(manifest, tmp_path).output
    plan = run(manifest, tmp_path, "--dry-run", "--set", "mot.pixel_origin=1")
    assert plan.output.startswith("patch: the recipe has changed: mot.pixel_origin\n")
    plan = run(manifest, tmp_path, "--dry-run", "--fresh")
    assert plan.output.startswith("patch: all are to be done anew\n")


def test_a_cache_alone_is_no_output_in_the_way(manifest, tmp_path):
    (tmp_path / ".cache" / "patch").mkdir(parents=True)
    assert run(manifest, tmp_path).exit_code == 0


def test_events_are_lines_for_people_and_json_for_machines(manifest, tmp_path):
    log = tmp_path / "log.jsonl"
    loud = run(manifest, tmp_path / "out", "--verbose", "--log-json", str(log))
    said = [line.split(" ", 1)[1] for line in loud.stderr.splitlines() if line[2:3] == ":"]
    assert said[:2] == ["1 of 1 videos to do", "patch: started"]
    assert said[2].startswith("patch: done in ")
    events = [json.loads(line) for line in log.read_text().splitlines()]
    assert [event["event"] for event in events if event["event"] != "progress"] == [
        "batch", "started", "done", "ended",
    ]  # fmt: skip
    assert events[-1]["succeeded"] == 1
    run(manifest, tmp_path / "out", "--log-json", str(log))
    assert len(log.read_text().splitlines()) > len(events)
    quiet = run(manifest, tmp_path / "out", "--quiet")
    assert (quiet.exit_code, quiet.output) == (0, "")


def test_quiet_still_tells_failures(manifest, tmp_path):
    broken = manifest.parent / "broken.json"
    document = json.loads(manifest.read_text())
    document["videos"][0]["path"] = "none.mp4"
    broken.write_text(json.dumps(document))
    outcome = run(broken, tmp_path, "--quiet")
    assert (outcome.exit_code, outcome.stdout) == (1, "")
    assert "failed (missing)" in outcome.stderr


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--shard", "3/2"], "not I/N"),
        (["--shard", "0/2"], "not I/N"),
        (["--shard", "one"], "not I/N"),
        (["--verbose", "--quiet"], "exclude each other"),
        (["--scheduler", "tcp://nowhere:1"], "go together"),
    ],
)
def test_options_that_make_no_sense(manifest, tmp_path, options, said):
    outcome = run(manifest, tmp_path, *options)
    assert outcome.exit_code == 2
    assert said in outcome.stderr


def test_shards_are_joined_in_the_order_of_the_manifest(manifest, tmp_path):
    job = load_manifest(manifest).jobs[0]
    many = manifest.parent / "many.json"
    many.write_text(dump_manifest([replace(job, id=name) for name in "edcba"], manifest.parent))
    merge = partial(CliRunner().invoke, cli, ["merge", str(tmp_path)])
    assert "no shard has run here" in merge().stderr
    assert run(many, tmp_path, "--shard", "1/2").exit_code == 0
    assert not (tmp_path / "batch.json").exists()
    assert "shard 2/2 has not run here" in merge().stderr
    assert run(many, tmp_path, "--shard", "2/2").exit_code == 0
    joined = merge()
    assert joined.exit_code == 0, joined.output
    assert "5 of 5 videos annotated" in joined.output
    ids = [video["id"] for video in json.loads((tmp_path / "batch.json").read_text())["videos"]]
    assert ids == [*"edcba"]
    assert "1 of 5 videos annotated (5 were" not in run(many, tmp_path).output
    assert "5 were up to date" in run(many, tmp_path).output
    assert "no shard has run here" in merge().stderr


def test_status_tells_how_far_a_batch_is(manifest, tmp_path):
    status = partial(CliRunner().invoke, cli)
    assert status(["status", str(tmp_path)]).exit_code == 1
    run(manifest, tmp_path)
    lines = status(["status", str(tmp_path)]).output.splitlines()
    assert lines[0].endswith(": complete")
    assert lines[1] == "  1 of 1 videos done, 0 of them failed"
    (told,) = json.loads(status(["status", str(tmp_path), "--json"]).output)
    assert (told["state"], told["done"], told["failures"]) == ("complete", 1, [])


class Report:
    """As much of a batch's report as the lines are made of."""

    up_to_date = 0
    elapsed_s = 12.3
    recipe = Recipe()

    def __init__(self, *outcomes):
        self.outcomes = outcomes
        self.jobs = len(outcomes)
        self.counts = {"succeeded": len(outcomes), "failed": 0, "left": 0}


def test_lines_tell_what_is_lost_and_what_to_review_first(manifest, tmp_path):
    job = load_manifest(manifest).jobs[0]
    report = annotate_video(job, tmp_path, load_recipe("csv_only"))
    review = (
        Suggestion(2, 118, Reason.DISAGREE, 0.2, 33.7),
        Suggestion(2, 7, Reason.LOST, 0.5, 2.0),
    )
    track = TrackSummary(
        2,
        "car",
        human_boxes=2,
        tracked_boxes=60,
        interpolated_boxes=20,
        lost_frames=12,
        mean_confidence=0.5,
        review=review,
    )
    one = replace(report, id="clip", tracks=(track,))
    none = replace(report, id="other", tracks=(TrackSummary(1, "bird"),))
    lines = summary_lines(Report(none, one), tmp_path)
    columns = lines[0].split()
    cells = dict(zip(columns, lines[2].split(), strict=True))
    assert (cells["boxes"], cells["lost"], cells["confidence"]) == ("70", "12", "0.50")
    assert cells["review"] == "2"
    assert lines[-2] == ("Review first: clip, track 2, frame 118 (passes disagree, +34 frames)")
    report_file = tmp_path / "report.html"
    assert lines[-1] == f"2 of 2 videos annotated in 12.3 s; look at {report_file}."
    assert len(lines[0]) < 80
    assert not any("Review" in line for line in summary_lines(Report(none), tmp_path))
