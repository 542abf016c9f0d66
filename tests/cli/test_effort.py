"""``situp-annotate effort``, on a folder in OTB layout."""

import json

import pytest
from click.testing import CliRunner
from support.targets import corner_truth, write_sequence

from situp_annotate.cli import cli
from situp_annotate.cli.effort import effort
from situp_annotate.evaluation.contenders import CONTENDERS
from situp_annotate.evaluation.effort import MOST_BOXES


@pytest.fixture
def sequences(tmp_path):
    write_sequence(tmp_path / "sequences" / "corner", corner_truth())
    return tmp_path / "sequences"


def run(*arguments):
    return CliRunner().invoke(cli, ["effort", *map(str, arguments)])


def test_figures_tables_and_curves(tmp_path, sequences):
    pytest.importorskip("matplotlib")
    path, plot = tmp_path / "effort.json", tmp_path / "effort.png"
    options = ["--json", path, "--plot", plot, "--methods", "linear, both", "--most-boxes", "20"]
    outcome = run(sequences, *options)
    assert outcome.exit_code == 0, outcome.output
    assert "| target | frames | linear, worst | linear, suggested | both, worst |" in outcome.stdout
    document = json.loads(path.read_text())
    assert document["settings"] == {"methods": ["linear", "both"], "most_boxes": 20}
    linear = document["targets"]["corner"]["methods"]["linear"]["runs"]["worst"]
    assert linear["0.7"]["boxes"] == 3
    assert {"boxes_vs_linear", "recall3_wins", "thin_iou"} <= set(document["bars"])
    assert plot.stat().st_size > 0
    parts = {path.name for path in (tmp_path / "effort.json.parts").iterdir()}
    assert parts == {
        "corner.linear.json",
        "corner.both.json",
        "corner.linear.samples.npz",
        "corner.both.samples.npz",
    }


def test_an_unknown_method_is_wrong_use(tmp_path, sequences):
    outcome = run(sequences, "--json", tmp_path / "effort.json", "--methods", "linear,magic")
    assert outcome.exit_code == 2
    assert "'magic' is no method; known are hold, linear" in outcome.stderr


def test_a_folder_without_sequences_is_told(tmp_path):
    outcome = run(tmp_path, "--json", tmp_path / "effort.json")
    assert outcome.exit_code == 1
    assert "no sequence here" in outcome.stderr


def test_defaults_are_those_of_the_library():
    defaults = {option.name: option.default for option in effort.params}
    assert tuple(defaults["methods"].split(",")) == tuple(CONTENDERS)
    assert defaults["most_boxes"] == MOST_BOXES
