"""Means over groups, tables and plots of figures that are known."""

import numpy as np
import pytest

from situp_annotate.evaluation.benchmark import Target
from situp_annotate.evaluation.curve_plots import draw_curves
from situp_annotate.evaluation.evaluation_report import (
    Evaluation,
    TrackerResult,
    evaluation_document,
)
from situp_annotate.evaluation.evaluation_tables import evaluation_tables, latex, markdown
from situp_annotate.evaluation.scores import Scores


def flat(share):
    """Scores whose every figure is this share."""
    return Scores((share,) * 21, (share,) * 51, (share,) * 51)


def evaluation(*, missing=False):
    truth = np.array([[1.0, 1, 5, 5], [0, 1, 5, 5]])
    targets = [
        Target("A", "A", truth, attributes=("SV", "IV"), sets=("otb50",)),
        Target("B_1", "B_1", truth, attributes=("SV",)),
    ]
    ours = TrackerResult(
        "ours", "run here", {"ope": {"A": flat(0.5), "B_1": flat(0.75)}}, {"A": 100.0, "B_1": 400.0}
    )
    theirs = {"A": flat(0.75)} if missing else {"A": flat(0.75), "B_1": flat(0.25)}
    return Evaluation(targets, [ours, TrackerResult("the_irs", "text", {"ope": theirs})], ("ope",))


def test_means_of_groups():
    document = evaluation_document(evaluation())
    ours = document["trackers"]["ours"]["ope"]
    assert {name: each["auc"] for name, each in ours["sets"].items()} == pytest.approx(
        {"all": 0.625, "otb50": 0.5}
    )
    assert {name: each["targets"] for name, each in ours["attributes"].items()} == {
        "IV": 1,
        "SV": 2,
    }
    assert ours["attributes"]["SV"]["precision"] == 0.625
    assert document["trackers"]["ours"]["frames_per_second"] == pytest.approx(200)
    assert document["trackers"]["the_irs"]["frames_per_second"] is None
    assert document["targets"]["A"]["absent_frames"] == 1
    assert document["protocol"]["success"]["thresholds"][:3] == [0, 0.05, 0.1]
    assert document["protocol"]["success"]["counts_if"] == "overlap > threshold"


def test_table_in_markdown():
    lines = markdown(evaluation_tables(evaluation())).splitlines()
    assert lines[6] == "| ours | **0.625** | **0.625** | **0.625** | 200.0 | 2 |"
    assert lines[7] == "| the\\_irs | 0.500 | 0.500 | 0.500 | – | 2 |"
    assert "| tracker | all (2) | otb50 (1) |" in lines
    assert "| tracker | IV (1) | SV (2) |" in lines
    assert "| B\\_1 | **0.750** | 0.250 |" in lines


def test_means_over_fewer_targets_are_in_brackets_and_not_compared():
    lines = markdown(evaluation_tables(evaluation(missing=True))).splitlines()
    assert "| the\\_irs | (0.750) | (0.750) | (0.750) | – | 1 of 2 |" in lines
    assert "| tracker | all (2) | common (1) | otb50 (1) |" in lines
    assert "| the\\_irs | (0.750) | **0.750** | **0.750** |" in lines
    assert "| B\\_1 | – | 0.750 |" in lines


def test_table_in_latex():
    text = latex(evaluation_tables(evaluation(missing=True)))
    assert r"ours & 0.625 & 0.625 & 0.625 & 200.0 & 2 \\" in text
    assert r"the\_irs & (0.750) & \textbf{0.750} & \textbf{0.750} \\" in text
    assert text.count(r"\begin{table}") == text.count(r"\end{table}") == 7


def test_plots_are_of_what_all_have_and_sorted_by_figure(tmp_path):
    pytest.importorskip("matplotlib")
    written = draw_curves(evaluation(missing=True), "ope", tmp_path)
    assert sorted(path.name for path in written) == [
        "precision.png",
        "precision.svg",
        "success.png",
        "success.svg",
    ]
    assert all(path.stat().st_size > 1000 for path in written)
    svg = (tmp_path / "success.svg").read_text()
    assert "Success plot, OPE, 1 target " in svg
    assert svg.index("the_irs [0.750]") < svg.index("ours [0.500]")


def test_the_same_figures_draw_the_same_files(tmp_path):
    pytest.importorskip("matplotlib")
    for name in ("a", "b"):
        draw_curves(evaluation(), "ope", tmp_path / name)
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()


def test_nothing_is_drawn_where_trackers_have_no_target_in_common(tmp_path):
    lonely = evaluation(missing=True)
    ours = TrackerResult("ours", "run here", {"ope": {"B_1": flat(1.0)}})
    lonely = Evaluation(lonely.targets, [ours, lonely.trackers[1]], ("ope",))
    assert draw_curves(lonely, "ope", tmp_path) == []
    assert "| ours | (1.000) |" in markdown(evaluation_tables(lonely))


def test_many_trackers_have_their_legend_beside(tmp_path):
    pytest.importorskip("matplotlib")
    one = evaluation()
    many = [TrackerResult(f"t{i}", "text", {"ope": {"A": flat(i / 20)}}) for i in range(20)]
    assert draw_curves(Evaluation(one.targets[:1], many, ("ope",)), "ope", tmp_path)
