"""Scores of many objects at a time: HOTA, MOTA, IDF1 and their parts, by TrackEval.

TrackEval matches and counts; it is loaded when something is scored. What it gets is made here as
its own reader for MOTChallenge makes it: truth with flag 0 is left out, and where classes are to be
ignored, boxes of the result that match truth of such a class are taken out first.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from situp_annotate.errors import SitupError
from situp_annotate.formats.mot.rows import MotRow
from situp_annotate.propagation.fusion import overlaps

__all__ = ["COUNTS", "RATES", "MotScores", "MotSequence", "ScoreOptions", "score_sequences"]

_IGNORED_OVERLAP = 0.5
"""From which on a box belongs to truth that is to be ignored; TrackEval's, whatever is asked."""

_Array: TypeAlias = npt.NDArray[np.float64]
_Results: TypeAlias = Mapping[str, Any]

RATES: Mapping[str, tuple[str, str]] = {
    **{name: ("HOTA", name) for name in ("HOTA", "DetA", "AssA", "LocA")},
    **{name: ("HOTA", name) for name in ("DetRe", "DetPr", "AssRe", "AssPr")},
    **{name: ("CLEAR", name) for name in ("MOTA", "MOTP")},
    **{name: ("Identity", name) for name in ("IDF1", "IDR", "IDP")},
}
"""Shares, mostly in [0, 1]: TrackEval's metric and field of each."""

COUNTS: Mapping[str, tuple[str, str]] = {
    **{name: ("CLEAR", f"CLR_{name}") for name in ("TP", "FP", "FN")},
    **{name: ("CLEAR", name) for name in ("IDSW", "Frag", "MT", "PT", "ML")},
    **{name: ("Identity", name) for name in ("IDTP", "IDFP", "IDFN")},
}
"""Whole numbers; as `RATES`."""


@dataclass(frozen=True, slots=True)
class ScoreOptions:
    """What counts, and from when on a box is found.

    Attributes
    ----------
    iou : float
        Least overlap of a found box, for CLEAR (MOTA) and identity (IDF1); HOTA takes its mean
        over 0.05, 0.1 … 0.95.
    classes : tuple of int
        Of the truth that counts; empty for all.
    ignored_classes : tuple of int
        Of truth that may be found or not: it does not count, and neither does what finds it.
    """

    iou: float = 0.5
    classes: tuple[int, ...] = ()
    ignored_classes: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class MotSequence:
    """A result and its truth.

    Attributes
    ----------
    name : str
        Of the video.
    result, truth : sequence of MotRow
        With pixels of the same origin.
    """

    name: str
    result: Sequence[MotRow]
    truth: Sequence[MotRow]


@dataclass(frozen=True, slots=True)
class MotScores:
    """Figures of one video, or of all.

    Attributes
    ----------
    rates : dict of str to float
        By the names in `RATES`.
    counts : dict of str to int
        By the names in `COUNTS`.
    boxes : dict of str to int
        How many there are: ``truth_boxes`` and ``truth_objects`` that count, ``truth_left_out``
        (flag 0 or other class), ``result_boxes`` and ``result_tracks``, ``result_ignored``.
    """

    rates: dict[str, float]
    counts: dict[str, int]
    boxes: dict[str, int]


def score_sequences(
    sequences: Sequence[MotSequence], options: ScoreOptions
) -> tuple[dict[str, MotScores], MotScores]:
    """Score each video, and all together as TrackEval combines them: box by box.

    Parameters
    ----------
    sequences : sequence of MotSequence
        At least one; names differ.
    options : ScoreOptions
        What counts.

    Returns
    -------
    dict of str to MotScores
        By name.
    MotScores
        Of all.

    Raises
    ------
    SitupError
        If TrackEval is not there, or no truth counts.
    """
    metrics = _metrics(options.iou)
    prepared = {each.name: _prepare(each, options) for each in sequences}
    if not any(each.boxes["truth_boxes"] for each in prepared.values()):
        raise SitupError(_no_truth(sequences, options))
    results = {
        kind: {name: metric.eval_sequence(each.data) for name, each in prepared.items()}
        for kind, metric in metrics.items()
    }
    videos = {
        name: _scores({kind: results[kind][name] for kind in metrics}, each.boxes)
        for name, each in prepared.items()
    }
    together = {kind: metric.combine_sequences(results[kind]) for kind, metric in metrics.items()}
    keys = next(iter(prepared.values())).boxes
    boxes = {key: sum(each.boxes[key] for each in prepared.values()) for key in keys}
    return videos, _scores(together, boxes)


def _metrics(iou: float) -> dict[str, Any]:
    try:
        from trackeval.metrics import CLEAR, HOTA, Identity
    except ImportError as error:
        raise SitupError(
            f"Scores need TrackEval, which cannot be loaded ({error}); install it with "
            "pip install 'situp-annotate[mot]'."
        ) from error
    # TrackEval adds to the dictionary that it is given.
    clear, identity = ({"THRESHOLD": iou, "PRINT_CONFIG": False} for _ in range(2))
    return {"HOTA": HOTA(), "CLEAR": CLEAR(clear), "Identity": Identity(identity)}


def _no_truth(sequences: Sequence[MotSequence], options: ScoreOptions) -> str:
    rows = [row for each in sequences for row in each.truth]
    if not rows:
        return "The truth has no box; give truth that has some."
    classes = sorted({row.class_number for row in rows if row.class_number is not None})
    there = f"; classes there are {', '.join(map(str, classes[:20]))}" if classes else ""
    asked = "is of another class or " if options.classes or options.ignored_classes else ""
    return f"No box of the truth counts: each {asked}has flag 0{there}; give truth that counts."


# ---- rows to what TrackEval takes ----------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Prepared:
    """What TrackEval takes, and how many boxes that are."""

    data: dict[str, Any]
    boxes: dict[str, int]


def _by_frame(rows: Iterable[MotRow]) -> defaultdict[int, list[MotRow]]:
    frames = defaultdict(list)
    for row in rows:
        frames[row.frame].append(row)
    return frames


def _overlap_matrix(truth: Sequence[MotRow], result: Sequence[MotRow]) -> _Array:
    """(truth, result): intersection over union."""
    boxes, others = (
        np.array([(r.box.x, r.box.y, r.box.width, r.box.height) for r in rows]).reshape(-1, 4)
        for rows in (truth, result)
    )
    with np.errstate(invalid="ignore"):  # of boxes so thin that no area is left
        each = overlaps(np.repeat(boxes, len(others), axis=0), np.tile(others, (len(boxes), 1)))
    return np.nan_to_num(each).reshape(len(boxes), len(others))


def _without_ignored(
    truth: Sequence[MotRow], result: Sequence[MotRow], ignored: Sequence[int]
) -> list[MotRow]:
    """The result without boxes that match ignored truth; all truth may match, even with flag 0."""
    matrix = _overlap_matrix(truth, result)
    matrix[matrix < _IGNORED_OVERLAP - np.finfo(float).eps] = 0
    pairs = zip(*linear_sum_assignment(-matrix), strict=True)
    out = {
        column
        for row, column in pairs
        if matrix[row, column] > 0 and truth[row].class_number in ignored
    }
    return [row for column, row in enumerate(result) if column not in out]


def _counts(row: MotRow, options: ScoreOptions) -> bool:
    number = row.class_number
    wanted = number in options.classes if options.classes else True
    return row.confidence != 0 and wanted and number not in options.ignored_classes


def _prepare(sequence: MotSequence, options: ScoreOptions) -> _Prepared:
    truths, results = _by_frame(sequence.truth), _by_frame(sequence.result)
    kept = {}
    for frame, rows in results.items():
        kept[frame] = (
            _without_ignored(truths[frame], rows, options.ignored_classes)
            if options.ignored_classes
            else rows
        )
    counted = {f: [row for row in rows if _counts(row, options)] for f, rows in truths.items()}
    # Frames without any box change nothing, and there may be any number of them.
    frames = sorted(counted.keys() | kept.keys())
    truth_boxes = [counted.get(frame, []) for frame in frames]
    result_boxes = [kept.get(frame, []) for frame in frames]
    truth_ids, objects = _renumbered(truth_boxes)
    result_ids, tracks = _renumbered(result_boxes)
    boxes = {
        "truth_boxes": sum(map(len, truth_boxes)),
        "truth_objects": objects,
        "truth_left_out": len(sequence.truth) - sum(map(len, truth_boxes)),
        "result_boxes": sum(map(len, result_boxes)),
        "result_tracks": tracks,
        "result_ignored": len(sequence.result) - sum(map(len, result_boxes)),
    }
    data = {
        "num_timesteps": len(frames),
        "num_gt_ids": objects,
        "num_tracker_ids": tracks,
        "num_gt_dets": boxes["truth_boxes"],
        "num_tracker_dets": boxes["result_boxes"],
        "gt_ids": truth_ids,
        "tracker_ids": result_ids,
        "similarity_scores": list(map(_overlap_matrix, truth_boxes, result_boxes)),
    }
    return _Prepared(data, boxes)


def _renumbered(frames: Sequence[Sequence[MotRow]]) -> tuple[list[npt.NDArray[np.int64]], int]:
    """Ids of each frame, numbered from 0 without a gap, and how many there are."""
    ids = sorted({row.track_id for rows in frames for row in rows})
    places = {track_id: place for place, track_id in enumerate(ids)}
    return [np.array([places[row.track_id] for row in rows], np.int64) for rows in frames], len(ids)


def _scores(results: Mapping[str, _Results], boxes: dict[str, int]) -> MotScores:
    # HOTA and its parts are a number for each overlap, of which the mean counts.
    rates = {name: float(np.mean(results[kind][field])) for name, (kind, field) in RATES.items()}
    counts = {name: int(results[kind][field]) for name, (kind, field) in COUNTS.items()}
    return MotScores(rates, counts, boxes)
