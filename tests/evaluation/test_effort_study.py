"""All targets and methods: results that are kept, bars, tables."""

import json
from dataclasses import replace

import numpy as np
import pytest
from support.targets import corner_truth, curved_truth, write_sequence

from situp_annotate.errors import OutputError, SitupError
from situp_annotate.evaluation import effort_study, find_sequences, fitting, plots
from situp_annotate.evaluation.calibration import calibration
from situp_annotate.evaluation.effort import Simulation
from situp_annotate.evaluation.effort_report import bars, effort_document
from situp_annotate.evaluation.effort_study import (
    MethodResult,
    Settings,
    TargetResult,
    load_samples,
    run_study,
)
from situp_annotate.evaluation.effort_tables import effort_tables
from situp_annotate.evaluation.fitting import predict_left_out
from situp_annotate.evaluation.samples import Samples

LINEAR = Settings(methods=("linear",))


@pytest.fixture
def sequences(tmp_path):
    write_sequence(tmp_path / "sequences" / "corner", corner_truth())
    write_sequence(tmp_path / "sequences" / "curved", curved_truth())
    return find_sequences(tmp_path / "sequences")


@pytest.fixture
def simulated(monkeypatch):
    """Names of the targets that are really simulated, each time."""
    names = []
    simulate = effort_study.simulate

    def counting(subject, *arguments, **options):
        names.append(subject.name)
        return simulate(subject, *arguments, **options)

    monkeypatch.setattr(effort_study, "simulate", counting)
    return names


def test_what_is_there_is_not_simulated_again(tmp_path, sequences, simulated):
    first = run_study(sequences, tmp_path / "parts", LINEAR)
    assert simulated == ["corner"] * 4 + ["curved"] * 4
    assert run_study(sequences, tmp_path / "parts", LINEAR) == first
    assert len(simulated) == 8
    (tmp_path / "parts" / "curved.linear.json").write_text("{")
    assert run_study(sequences, tmp_path / "parts", LINEAR) == first
    assert simulated[8:] == ["curved"] * 4
    run_study(sequences, tmp_path / "parts", replace(LINEAR, most_boxes=9))
    assert len(simulated) == 20


def test_another_truth_is_simulated_anew(tmp_path, sequences, simulated):
    run_study(sequences[:1], tmp_path / "parts", LINEAR)
    path = sequences[0].folder / "groundtruth_rect.txt"
    path.write_text(path.read_text().replace("30.0", "31.0"))
    run_study(find_sequences(tmp_path / "sequences")[:1], tmp_path / "parts", LINEAR)
    assert len(simulated) == 8


def test_runs_are_those_of_the_method(tmp_path, sequences):
    (target,) = run_study(sequences[:1], tmp_path, Settings(methods=("linear", "both")))
    assert (target.name, target.frames) == ("corner", 30)
    for result in target.methods.values():
        assert [*result.runs] == ["worst", "worst_jittered", "suggested", "suggested_jittered"]
    assert target.methods["linear"].runs["worst"].boxes_drawn == {0.7: 3, 0.5: 3}
    assert target.methods["linear"].quality is None
    assert target.methods["both"].quality is not None
    samples = load_samples(tmp_path, ["corner", "none"])
    assert set(samples.pick) == {"worst", "suggested"}


def test_processes_give_the_same_in_the_same_order(tmp_path, sequences):
    told = []
    apart = run_study(
        sequences, tmp_path / "a", LINEAR, workers=2, on_target=lambda t: told.append(t.name)
    )
    assert apart == run_study(sequences, tmp_path / "b", LINEAR)
    assert [target.name for target in apart] == ["corner", "curved"]
    assert sorted(told) == ["corner", "curved"]


def test_mil_repeats_itself_in_a_process_of_its_own(tmp_path, sequences):
    settings = Settings(methods=("mil",))
    once, again = (
        run_study(sequences[1:], tmp_path / name, settings, workers=1) for name in ("a", "b")
    )
    assert once == again
    assert [*once[0].methods["mil"].runs] == ["worst"]
    assert len(once[0].methods["mil"].runs["worst"].recalls[0.7]) <= 3


def run(boxes, recall3=0.5, *, reached=True):
    recalls = (0.1, 0.2, recall3)
    return Simulation(
        100, {0.7: boxes, 0.5: boxes}, {0.7: reached, 0.5: reached}, {0.7: recalls, 0.5: recalls}
    )


def target(name, **boxes_and_recalls):
    methods = {
        method: MethodResult(
            "", {r: run(*each) for r in ("worst", "worst_jittered", "suggested",
                                         "suggested_jittered")},
        )
        for method, each in boxes_and_recalls.items()
    }  # fmt: skip
    return TargetResult(name, 100, methods)


TARGETS = [
    target("a", linear=(8, 0.2), forward=(6, 0.5), both=(2, 0.7)),
    target("b", linear=(4, 0.4), forward=(9, 1.0), both=(9, 1.0)),
    target("c", linear=(4, 0.6), forward=(9, 0.3), both=(8, 0.6)),
]


def test_bars_by_hand():
    found = bars(TARGETS, Samples.joined([]))
    assert found == pytest.approx(
        {
            "boxes_vs_linear": (2 / 8 * 9 / 4 * 8 / 4) ** (1 / 3),
            "boxes_vs_forward": (2 / 6 * 9 / 9 * 8 / 9) ** (1 / 3),
            "suggested_boxes_vs_linear": (2 / 8 * 9 / 4 * 8 / 4) ** (1 / 3),
            "worst_excess_boxes": 5,
            "recall3_wins": 2 / 3,  # b is a tie at 1, c one below
            "recall3_gain_over_linear": 100 * (0.5 + 0.6 + 0) / 3,
        }
    )


def test_bars_that_cannot_be_told_are_left_out():
    assert bars([target("a", linear=(8, 0.2))], Samples.joined([])) == {}


def test_intervals_hold_the_bar():
    document = effort_document(TARGETS, Samples.joined([]), {})
    low, high = document["intervals_95"]["boxes_vs_linear"]
    assert low < document["bars"]["boxes_vs_linear"] < high
    figures = document["targets"]["a"]["methods"]["both"]["runs"]["worst"]["0.7"]
    assert figures["boxes_per_100_frames"] == 2
    assert figures["recall_by_budget"] == {"1": 0.1, "2": 0.2, "3": 0.7, "5": 0.7, "10": 0.7}
    json.dumps(document)


def test_tables():
    given_up = TargetResult(
        "d", 100, {m: MethodResult("", {r: run(250, reached=False) for r in result.runs})
                   for m, result in TARGETS[0].methods.items()},
    )  # fmt: skip
    lines = effort_tables([*TARGETS, given_up])
    assert "| a | 100 | 8 | 8 | 6 | 6 | 2 | 2 |" in lines
    assert "| d | 100 | > 250 | > 250 | > 250 | > 250 | > 250 | > 250 |" in lines
    assert "| linear | 0.100 | 0.200 | 0.425 | 0.425 | 0.425 |" in lines
    # 269 boxes of 7 s; 400 frames, or those that are suggested, of 0.75 s
    assert "| both, worst | 269 | 400 | 36 |" in lines
    assert "| both, suggested | 269 | 265 | 35 |" in lines


def test_curves(tmp_path):
    pytest.importorskip("matplotlib")
    plots.draw_recalls(TARGETS, tmp_path / "curves.png")
    assert (tmp_path / "curves.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(OutputError, match="cannot write here"):
        plots.draw_recalls(TARGETS, tmp_path / "none" / "curves.png")


def test_without_matplotlib_the_extra_is_named(monkeypatch):
    monkeypatch.setattr(plots, "find_spec", lambda _: None)
    with pytest.raises(SitupError, match=r"situp-annotate\[evaluate\]"):
        plots.require_matplotlib()


def test_nan_is_no_figure():
    right = np.ones(20)
    samples = Samples(
        np.zeros((20, 3)), right, right, right.astype(int), np.full(20, "suggested"),
        np.array(["a", "b"] * 10),
    )  # fmt: skip
    found = bars([target("a", linear=(8, 0.2))], samples)
    assert set(found) == {"confidence_ece"}


def test_confidence_is_judged_on_sequences_that_were_left_out():
    """Where one sequence says the contrary of all others, it is judged by the others."""
    rng = np.random.default_rng(0)
    peak, sequence = rng.uniform(0, 1, 400), np.repeat(["a.1", "a.2", "b", "c"], 100)
    overlap = np.where((peak > 0.5) ^ (sequence == "c"), 1.0, 0.0)
    features = np.column_stack([np.ones(400), peak])
    samples = Samples(
        features, overlap, peak, np.ones(400, int), np.full(400, "suggested"), sequence
    )
    chance = predict_left_out(samples, 0.5)
    others = chance[sequence == "c"]
    assert np.corrcoef(others, peak[sequence == "c"])[0, 1] > 0.9
    assert calibration(others, overlap[sequence == "c"]).auroc < 0.05


def test_fitted_coefficients_have_names(monkeypatch):
    monkeypatch.setattr(fitting, "feature_names", lambda: ("constant", "peak"))
    peak = np.linspace(0, 1, 50)
    samples = Samples(
        np.column_stack([np.ones(50), peak]), (peak > 0.4).astype(float), peak,
        np.ones(50, int), np.full(50, "worst"), np.full(50, "a"),
    )  # fmt: skip
    found = fitting.fit(samples, 0.5)
    assert -found["constant"] / found["peak"] == pytest.approx(0.4, abs=0.05)
