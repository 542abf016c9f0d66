"""Runs of trackers that are known, on small sequences; what is finished is kept."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.targets import SIZE_HW, corner_truth, curved_truth, write_sequence

from situp_annotate.errors import SitupError
from situp_annotate.evaluation import benchmark_study
from situp_annotate.evaluation.benchmark import load_targets
from situp_annotate.evaluation.benchmark_study import PartName, run_benchmark
from situp_annotate.evaluation.robustness import shifted_boxes, temporal_starts
from situp_annotate.evaluation.tracker_runs import run_target, score_runs
from situp_annotate.types import BoundingBox


class Standing:
    """Says that the target stays where it was; counts what it is asked."""

    made = 0
    fails_on = None

    def __init__(self):
        type(self).made += 1

    def init(self, image, box):
        assert image.shape[:2] == SIZE_HW
        if box == self.fails_on:
            raise RuntimeError("no such target")
        self.box = box

    def update(self, image):
        return SimpleNamespace(box=self.box)


@pytest.fixture
def standing(monkeypatch):
    class Fresh(Standing):
        made = 0

    monkeypatch.setattr(benchmark_study, "make_tracker", lambda _: Fresh())
    return Fresh


@pytest.fixture
def targets(tmp_path):
    write_sequence(tmp_path / "sequences" / "corner", corner_truth())
    write_sequence(tmp_path / "sequences" / "curved", curved_truth())
    return load_targets(tmp_path / "sequences")


NAMES = [PartName("it", "corner", "ope"), PartName("it", "curved", "ope")]


def test_one_pass_begins_with_the_true_box(targets):
    (run,) = run_target(Standing, targets[0], "ope")
    assert (run.first, len(run.boxes)) == (0, 30)
    assert set(run.boxes) == {tuple(targets[0].truth[0])}
    assert 0 < run.seconds < 1
    scores = score_runs([run], targets[0])
    # The target is 100 wide, goes right by 4 a frame to 40, and back by 2 a frame to 2.
    steps = np.interp(np.arange(30), [0, 10, 29], [0, 40, 2])
    assert scores.precision == pytest.approx((steps <= 20).mean())
    overlap = (100 - steps) / (100 + steps)
    assert scores.success_curve[10] == pytest.approx((overlap > 0.5).mean())


def test_temporal_runs_go_to_the_end(targets):
    runs = run_target(Standing, targets[1], "tre")
    assert [run.first for run in runs] == temporal_starts(targets[1].truth)
    assert all(run.boxes[0] == tuple(targets[1].truth[run.first]) for run in runs)
    assert all(run.first + len(run.boxes) == 30 for run in runs)


def test_spatial_runs_begin_beside_the_truth(targets):
    runs = run_target(Standing, targets[1], "sre")
    assert [run.boxes[0] for run in runs] == shifted_boxes(tuple(targets[1].truth[0]), SIZE_HW)
    assert all(run.boxes[0] == run.boxes[-1] for run in runs)


def test_only_frames_with_truth_are_run(tmp_path, targets):
    few = replace(targets[0], truth=targets[0].truth[:7])
    (run,) = run_target(Standing, few, "ope")
    assert len(run.boxes) == 7


@pytest.mark.parametrize(
    ("truth", "message"),
    [
        (np.ones((31, 4)), "30 pictures, but the truth of corner has 31 rows"),
        (np.full((5, 4), np.nan), "the first row of the truth of corner is no box"),
        (np.array([[1.0, 1, 0, 5]]), "the first row of the truth of corner is no box"),
    ],
)
def test_truth_that_cannot_be_followed(targets, truth, message):
    with pytest.raises(SitupError, match=message):
        run_target(Standing, replace(targets[0], truth=truth), "ope")


def test_temporal_runs_need_a_target(targets):
    with pytest.raises(SitupError, match="the truth of corner has no box to begin with"):
        run_target(Standing, replace(targets[0], truth=np.zeros((5, 4))), "tre")


def test_what_is_there_is_not_run_again(tmp_path, targets, standing):
    told = []
    first = run_benchmark(NAMES, targets, tmp_path / "p", on_part=told.append)
    assert (standing.made, told, [*first]) == (2, [False, False], NAMES)
    assert run_benchmark(NAMES, targets, tmp_path / "p", on_part=told.append) == first
    assert told[2:] == [True, True]
    assert standing.made == 2
    (tmp_path / "p" / "it" / "curved.ope.json").write_text("{")
    run_benchmark(NAMES, targets, tmp_path / "p")
    assert standing.made == 3
    run_benchmark(NAMES, targets, tmp_path / "p", fresh=True)
    assert standing.made == 5


def test_other_truth_pictures_or_versions_are_run_anew(tmp_path, targets, standing, monkeypatch):
    run_benchmark(NAMES, targets, tmp_path / "p")
    moved = replace(targets[0], truth=targets[0].truth + 1)
    run_benchmark(NAMES, [moved, targets[1]], tmp_path / "p")
    assert standing.made == 3
    picture = targets[1].folder / "img" / "0030.png"
    picture.write_bytes(picture.read_bytes() + b"\0")
    run_benchmark(NAMES, [moved, targets[1]], tmp_path / "p")
    assert standing.made == 4
    monkeypatch.setattr("situp_annotate.__version__", "99")
    run_benchmark(NAMES, [moved, targets[1]], tmp_path / "p")
    assert standing.made == 6


def test_a_tracker_that_fails_is_named_and_what_was_finished_stays(tmp_path, targets, standing):
    x, y, width, height = targets[1].truth[0]
    standing.fails_on = BoundingBox(x - 1, y - 1, width, height)
    with pytest.raises(
        SitupError, match="it: curved: the tracker fails in frame 0: RuntimeError: no such target"
    ):
        run_benchmark(NAMES, targets, tmp_path / "p")
    standing.fails_on = None
    run_benchmark(NAMES, targets, tmp_path / "p")
    assert standing.made == 3  # the first was not run again


def test_processes_give_the_same(tmp_path, targets):
    names = [PartName("situp", "corner", "ope"), PartName("situp", "curved", "ope")]
    few = [replace(target, truth=target.truth[:6]) for target in targets]
    apart = run_benchmark(names, few, tmp_path / "a", workers=2)
    here = run_benchmark(names, few, tmp_path / "b")
    assert [*apart] == names
    assert [part.runs[0].boxes for part in apart.values()] == [
        part.runs[0].boxes for part in here.values()
    ]
    assert json.loads((tmp_path / "a" / "situp" / "corner.ope.json").read_text())["key"]
