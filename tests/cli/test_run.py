"""``run``: its options, its table, and what it says to review first."""

import json
from dataclasses import replace

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
    return json.loads((output / "patch" / "summary.json").read_text())["cache"]


def test_what_was_tracked_is_kept_unless_told_otherwise(manifest, tmp_path):
    outcome = run(manifest, tmp_path, "--no-cache")
    assert outcome.exit_code == 0, outcome.output
    assert not (tmp_path / ".cache").exists()
    first = (tmp_path / "patch" / "mot.csv").read_bytes()
    for reused in (0, 3):
        outcome = run(manifest, tmp_path, "--overwrite")
        assert outcome.exit_code == 0, outcome.output
        assert cache_of(tmp_path) == {"passes": 3, "reused": reused}
        assert (tmp_path / "patch" / "mot.csv").read_bytes() == first
    run(manifest, tmp_path, "--overwrite", "--no-cache")
    assert cache_of(tmp_path) == {"passes": 3, "reused": 0}
    assert run(manifest, tmp_path).exit_code == 5


def test_a_cache_alone_is_no_output_in_the_way(manifest, tmp_path):
    (tmp_path / ".cache" / "patch").mkdir(parents=True)
    assert run(manifest, tmp_path).exit_code == 0


class Report:
    """As much of a batch's report as the lines are made of."""

    failures = ()
    elapsed_s = 12.3
    recipe = Recipe()

    def __init__(self, *outcomes):
        self.outcomes = outcomes


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
