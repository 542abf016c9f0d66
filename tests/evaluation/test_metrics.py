"""Scores of boxes whose overlap is known by construction, and the paper's own figures."""

import json

import numpy as np
import pytest

from situp_annotate.errors import SitupError
from situp_annotate.evaluation import evaluate_one_pass, find_sequences, overlaps, read_boxes


def test_overlap_of_known_boxes():
    boxes = np.array([[0, 0, 10, 10], [0, 0, 10, 10], [0, 0, 10, 10]], float)
    truth = np.array([[0, 0, 10, 10], [5, 0, 10, 10], [10, 0, 10, 10]], float)
    np.testing.assert_allclose(overlaps(boxes, truth), [1, 1 / 3, 0])


def test_perfect_result_misses_only_the_strict_threshold_of_one():
    truth = np.tile([3.0, 4, 20, 30], (5, 1))
    result = evaluate_one_pass(truth, truth)
    assert result.auc == pytest.approx(20 / 21)
    assert result.precision == 1


def test_first_frame_counts_as_truth():
    truth = np.tile([1.0, 1, 10, 10], (2, 1))
    result = evaluate_one_pass(truth + [100, 0, 0, 0], truth)
    np.testing.assert_allclose(result.overlaps, [1, 0])


def test_no_box_repeats_the_one_before():
    truth = np.tile([1.0, 1, 10, 10], (3, 1))
    boxes = np.array([[1, 1, 10, 10], [np.nan] * 4, [1, 1, 0, 5]])
    np.testing.assert_allclose(evaluate_one_pass(boxes, truth).overlaps, 1)


def test_absent_truth_misses_overlap_but_hits_precision():
    truth = np.array([[1, 1, 10, 10], [np.nan] * 4, [0, 1, 10, 10]], float)
    result = evaluate_one_pass(np.tile([1.0, 1, 10, 10], (3, 1)), truth)
    np.testing.assert_allclose(result.overlaps, [1, -1, -1])
    assert result.precision == 1


def test_precision_counts_twenty_pixels_as_a_hit():
    truth = np.tile([1.0, 1, 10, 10], (3, 1))
    boxes = truth + [[0, 0, 0, 0], [20, 0, 0, 0], [20.5, 0, 0, 0]]
    assert evaluate_one_pass(boxes, truth).precision == pytest.approx(2 / 3)


def test_normalized_error_is_in_sizes_of_the_truth():
    truth = np.tile([1.0, 1, 10, 40], (4, 1))
    boxes = truth + [[0, 0, 0, 0], [3, 0, 0, 0], [0, 16, 0, 0], [3, 16, 0, 0]]
    np.testing.assert_allclose(
        evaluate_one_pass(boxes, truth).normalized_errors, [0, 0.3, 0.4, 0.5]
    )


def test_sizes_that_differ_shift_the_centre_by_half():
    truth = np.tile([1.0, 1, 10, 10], (2, 1))
    result = evaluate_one_pass(truth + [0, 0, 6, 8], truth)
    np.testing.assert_allclose(result.center_errors, [0, 5])
    np.testing.assert_allclose(result.normalized_errors, [0, 0.5])
    np.testing.assert_allclose(result.overlaps, [1, 100 / 288])


def test_nothing_to_evaluate_is_an_error():
    with pytest.raises(ValueError, match="nothing to evaluate"):
        evaluate_one_pass(np.empty((0, 4)), np.empty((0, 4)))


def test_boxes_with_any_separator(tmp_path):
    path = tmp_path / "boxes.txt"
    path.write_text("1,2,3,4\n5\t6\t7\t8\n\n9 10 NaN NaN\n")
    np.testing.assert_array_equal(
        read_boxes(path), [[1, 2, 3, 4], [5, 6, 7, 8], [9, 10, np.nan, np.nan]]
    )


def test_bad_line_is_named(tmp_path):
    path = tmp_path / "boxes.txt"
    path.write_text("1,2,3,4\n1,2,3\n")
    with pytest.raises(SitupError, match=r"boxes\.txt: line 2: '1,2,3'"):
        read_boxes(path)


def test_sequences_with_one_and_with_two_targets(tmp_path):
    for name, truths in {"A": [""], "B": [".1", ".2"], "C": []}.items():
        (tmp_path / name / "img").mkdir(parents=True)
        for truth in truths:
            (tmp_path / name / f"groundtruth_rect{truth}.txt").write_text("11,21,30,40\n")
    found = find_sequences(tmp_path)
    assert [[target.name for target in sequence.targets] for sequence in found] == [
        ["A"],
        ["B.1", "B.2"],
    ]
    assert (found[0].targets[0].first_box.x, found[0].targets[0].first_box.y) == (10, 20)


@pytest.mark.parametrize(
    ("subset", "auc", "precision"),
    [("otb2013", 0.605, 0.812), ("otb50", 0.507, 0.708), (None, 0.576, 0.782)],
)
def test_authors_boxes_give_the_papers_figures(shared, subset, auc, precision):
    """Tables I and III of the paper, from the boxes its authors published."""
    folder = shared / "otb100"
    scores = []
    for name, facts in json.loads((folder / "attributes.json").read_text()).items():
        if subset is None or facts[subset]:
            truth = read_boxes(folder / "ground_truth" / f"{name}.txt")
            truth = truth[5:] if name == "Tiger1" else truth  # run from its sixth frame
            result = evaluate_one_pass(read_boxes(folder / "situp_authors" / f"{name}.txt"), truth)
            scores.append((result.auc, result.precision))
    np.testing.assert_allclose(np.mean(scores, axis=0), [auc, precision], atol=5e-4)
