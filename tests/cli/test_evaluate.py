"""``situp-annotate evaluate``: the command as a whole, and the paper's own figures."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from support.targets import corner_truth, curved_truth, write_sequence

from situp_annotate.cli import cli
from situp_annotate.evaluation import curve_plots
from situp_annotate.formats.otb import read_boxes

# Tables I and III of the paper: AUC and precision.
PAPER_SETS = {"otb2013": (0.605, 0.812), "otb50": (0.507, 0.708), "all": (0.576, 0.782)}
PAPER_ATTRIBUTES = {
    "SV": (0.542, 0.756),
    "MB": (0.579, 0.725),
    "IPR": (0.545, 0.744),
    "OPR": (0.552, 0.739),
    "FM": (0.537, 0.701),
    "DEF": (0.513, 0.708),
    "LR": (0.464, 0.709),
    "OV": (0.520, 0.669),
    "BC": (0.564, 0.769),
    "IV": (0.542, 0.727),
    "OCC": (0.572, 0.780),
}


@pytest.fixture
def sequences(tmp_path):
    folder = tmp_path / "sequences"
    write_sequence(folder / "corner", corner_truth()[:8])
    write_sequence(folder / "curved", curved_truth()[:8])
    truth = folder / "corner" / "groundtruth_rect.txt"
    (folder / "corner" / "authors.txt").write_text(truth.read_text())
    return folder


@pytest.fixture
def texts(tmp_path):
    """Truth as text only, and boxes that are all right."""
    folder = tmp_path / "texts"
    for place in ("ground_truth", "boxes"):
        (folder / place).mkdir(parents=True)
        (folder / place / "Car.txt").write_text("1,2,3,4\n" * 5)
    return folder


def run(*arguments):
    return CliRunner().invoke(cli, ["evaluate", *map(str, arguments)])


def figures(document, tracker, kind):
    groups = document["trackers"][tracker]["ope"][kind]
    return {name: (each["auc"], each["precision"]) for name, each in groups.items()}


def test_authors_boxes_give_the_papers_figures(shared, tmp_path):
    folder = shared / "otb100"
    outcome = run(folder, "--results", f"SITUP={folder / 'situp_authors'}", "--output", tmp_path)
    assert outcome.exit_code == 0, outcome.output
    assert "| SITUP | 0.576 | 0.782 |" in outcome.stdout
    document = json.loads((tmp_path / "evaluation.json").read_text())
    for kind, wanted in (("sets", PAPER_SETS), ("attributes", PAPER_ATTRIBUTES)):
        found = figures(document, "SITUP", kind)
        assert found.keys() == wanted.keys()
        for name, each in wanted.items():
            assert found[name] == pytest.approx(each, abs=5e-4), name
    assert document["trackers"]["SITUP"]["ope"]["sets"]["otb2013"]["targets"] == 51


def test_trackers_and_results_together(sequences, tmp_path):
    output = tmp_path / "scores"
    options = ["--trackers", "situp", "--results", "them=authors", "--output", output]
    outcome = run(sequences, *options, "--workers", 2)
    assert outcome.exit_code == 0, outcome.output
    assert "them has no boxes of 1 of 2 targets (curved)" in outcome.stderr
    assert "| them | (0.952) | (1.000) | (1.000) | – | 1 of 2 |" in outcome.stdout
    document = json.loads((output / "evaluation.json").read_text())
    assert document["trackers"]["situp"]["frames_per_second"] > 0
    assert document["trackers"]["situp"]["source"] == "run here"
    made = {path.name for path in output.iterdir()}
    assert {"boxes", "evaluation.json", "parts", "tables.md", "tables.tex"} <= made
    assert "from before" not in outcome.stderr
    once_more = run(sequences, *options)
    assert f"2 of 2 runs were in {output / 'parts'} from before" in once_more.stderr
    assert once_more.stdout == outcome.stdout
    # What was written reads back and gives the same figures.
    again = run(sequences, "--results", f"it={output / 'boxes' / 'situp'}", "-o", tmp_path / "b")
    assert again.exit_code == 0, again.output
    read = json.loads((tmp_path / "b" / "evaluation.json").read_text())
    assert figures(read, "it", "targets") == figures(document, "situp", "targets")
    np.testing.assert_array_equal(
        read_boxes(output / "boxes" / "situp" / "corner.txt")[0], [1, 31, 100, 30]
    )


def test_robustness_needs_no_single_pass(sequences, tmp_path):
    few = [word for each in ("tre", "sre") for word in ("--protocol", each)]
    outcome = run(sequences, "--trackers", "situp", *few, "--output", tmp_path / "out")
    assert outcome.exit_code == 0, outcome.output
    assert "## Temporal robustness evaluation (TRE)" in outcome.stdout
    document = json.loads((tmp_path / "out" / "evaluation.json").read_text())
    assert {"tre", "sre"} <= document["trackers"]["situp"].keys()
    assert not (tmp_path / "out" / "boxes").exists()


def test_without_matplotlib_the_rest_is_there(texts, tmp_path, monkeypatch):
    monkeypatch.setattr(curve_plots, "find_spec", lambda _: None)
    outcome = run(texts, "--results", f"it={texts / 'boxes'}", "--output", tmp_path / "out")
    assert outcome.exit_code == 0, outcome.output
    assert "pip install 'situp-annotate[evaluate]'" in outcome.stderr
    assert not (tmp_path / "out" / "success.png").exists()
    assert "| it | 0.952 | 1.000 | 1.000 | – | 1 |" in (tmp_path / "out" / "tables.md").read_text()


def test_trackers_need_pictures(texts, tmp_path):
    outcome = run(texts, "--trackers", "situp", "--output", tmp_path / "out")
    assert outcome.exit_code == 1
    assert "no pictures here, only truth as text; leave out --trackers" in outcome.stderr


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "Nothing to evaluate: give --trackers, --results or both."),
        (["--trackers", "magic"], "'magic' is no tracker; known are mosse"),
        (["--results", "folder"], "'folder': give NAME=FOLDER."),
        (["--results", "a=b", "--results", "a=c"], "'a' is given twice"),
        (["--trackers", "situp", "--results", "situp=x"], "a tracker that is run has this name"),
        (["--results", "a=b", "--protocol", "tre"], "need trackers to run"),
        (
            ["--trackers", "situp", "--results", "a=b", "--protocol", "sre"],
            "--results are scored by one pass",
        ),
    ],
)
def test_wrong_use(texts, tmp_path, options, message):
    outcome = run(texts, *options, "--output", tmp_path / "out")
    assert outcome.exit_code == 2
    assert message in " ".join(outcome.stderr.split())


def test_an_output_that_is_a_file(texts, tmp_path):
    (tmp_path / "out").write_text("")
    outcome = run(texts, "--results", f"it={texts / 'boxes'}", "--output", tmp_path / "out")
    assert outcome.exit_code == 2
