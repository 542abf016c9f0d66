"""Tables of the simulated annotator, in Markdown."""

import statistics
from collections.abc import Iterable, Sequence

from situp_annotate.evaluation.effort import BUDGETS, THRESHOLDS, Simulation
from situp_annotate.evaluation.effort_report import REPORTED, geometric_mean_of_boxes
from situp_annotate.evaluation.effort_study import JITTERED, TargetResult

__all__ = ["SECONDS_PER_BOX", "SECONDS_PER_LOOK", "effort_tables"]

SECONDS_PER_BOX = 7.0
"""A model, not a measurement: what drawing a box takes by extreme clicking."""

SECONDS_PER_LOOK = 0.75
"""A model, not a measurement: what looking at a frame takes."""


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    lines = [header, ["---"] * len(header), *rows]
    return [f"| {' | '.join(cells)} |" for cells in lines]


def _boxes(run: Simulation) -> str:
    """Boxes drawn, with > where the goal was not reached."""
    number = str(run.boxes_drawn[REPORTED])
    return number if run.reached[REPORTED] else f"> {number}"


def _runs(targets: Sequence[TargetResult]) -> list[tuple[str, str]]:
    """Method and run of the columns: all with exact boxes that go on to the goal."""
    methods = targets[0].methods.items()
    return [
        (method, run)
        for method, result in methods
        for run in result.runs
        if len(result.runs) > 1 and not run.endswith(JITTERED)
    ]


def _boxes_table(targets: Sequence[TargetResult]) -> list[str]:
    columns = _runs(targets)
    header = ["target", "frames", *(f"{method}, {run}" for method, run in columns)]
    rows = [
        [t.name, str(t.frames), *(_boxes(t.methods[method].runs[run]) for method, run in columns)]
        for t in targets
    ]
    for name, suffix in (("**geometric mean**", ""), ("**… of jittered boxes**", JITTERED)):
        means = [geometric_mean_of_boxes(targets, method, run + suffix) for method, run in columns]
        rows.append([name, "", *(f"{mean:.1f}" for mean in means)])
    return _table(header, rows)


def _recall_table(targets: Sequence[TargetResult], threshold: float) -> list[str]:
    rows = []
    for method, result in targets[0].methods.items():
        longest = [len(t.methods[method].runs["worst"].recalls[threshold]) for t in targets]
        told = BUDGETS if len(result.runs) > 1 else [b for b in BUDGETS if b <= max(longest)]
        means = [
            statistics.mean(
                t.methods[method].runs["worst"].recall_by_budget[threshold][budget] for t in targets
            )
            for budget in told
        ]
        cells = [f"{mean:.3f}" for mean in means]
        rows.append([method, *cells, *["–"] * (len(BUDGETS) - len(told))])
    return _table([f"recall at {threshold}", *map(str, BUDGETS)], rows)


def _time_table(targets: Sequence[TargetResult]) -> list[str]:
    rows = []
    for method, run in _runs(targets):
        boxes = sum(t.methods[method].runs[run].boxes_drawn[REPORTED] for t in targets)
        # Who picks the worst frames looks at all; who is told, at those they are told.
        looked = sum(t.frames for t in targets) if run == "worst" else boxes - len(targets)
        minutes = (SECONDS_PER_BOX * boxes + SECONDS_PER_LOOK * looked) / 60
        rows.append([f"{method}, {run}", str(boxes), str(looked), f"{minutes:.0f}"])
    return _table(["method", "boxes", "frames looked at", "minutes"], rows)


def effort_tables(targets: Sequence[TargetResult]) -> list[str]:
    """Lines of the tables.

    Parameters
    ----------
    targets : sequence of TargetResult
        At least one; all with the same methods.
    """
    lines = [f"Boxes drawn until 95 % of the frames overlap the truth by {REPORTED}:", ""]
    lines += _boxes_table(targets)
    lines += ["", "Mean recall in the other frames with so many boxes, worst frame corrected:"]
    for threshold in THRESHOLDS:
        lines += ["", *_recall_table(targets, threshold)]
    model = (
        f"Time of a person by a model: {SECONDS_PER_BOX:g} s a box and {SECONDS_PER_LOOK:g} s a "
        "frame looked at. Who picks the worst frames looks at all of them, once; who corrects "
        "what is suggested, at these only:"
    )
    return [*lines, "", model, "", *_time_table(targets)]
