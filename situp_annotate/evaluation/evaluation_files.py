"""An evaluation from a folder of sequences to files: what the command runs."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tqdm import tqdm

from situp_annotate.errors import SitupError
from situp_annotate.evaluation.benchmark import Target, load_targets
from situp_annotate.evaluation.benchmark_study import Part, PartName, run_benchmark
from situp_annotate.evaluation.curve_plots import can_draw, draw_curves
from situp_annotate.evaluation.evaluation_report import (
    Evaluation,
    TrackerResult,
    evaluation_document,
)
from situp_annotate.evaluation.evaluation_tables import (
    evaluation_tables,
    latex,
    markdown,
    overall_table,
)
from situp_annotate.evaluation.foreign_results import ForeignResults, read_results
from situp_annotate.evaluation.metrics import evaluate_one_pass
from situp_annotate.evaluation.scores import pooled_scores
from situp_annotate.evaluation.tracker_runs import PROTOCOLS, score_runs
from situp_annotate.formats.staging import write_whole
from situp_annotate.trackers import folder_name

__all__ = ["Plan", "evaluate_trackers"]

_NO_PLOTS = (
    "Plots were left out: matplotlib is not installed; install it with "
    "pip install 'situp-annotate[evaluate]' and run this again."
)

_KEPT = "{} of {} runs were in {} from before, with the speeds of then; --fresh runs all anew."


@dataclass(frozen=True, slots=True)
class Plan:
    """What to evaluate.

    Attributes
    ----------
    sequences : Path
        Folder in one of the layouts of :mod:`~situp_annotate.evaluation.benchmark`.
    output : Path
        Folder to write to; what finished runs left in its ``parts`` is used again.
    trackers : sequence of str
        Names of trackers to run.
    results : mapping of str to str
        Boxes of other trackers, by name, see :mod:`~situp_annotate.evaluation.foreign_results`;
        scored by one-pass evaluation.
    protocols : sequence of str
        Of ``PROTOCOLS``.
    attributes : Path or None
        File with attributes, instead of that beside the sequences.
    workers : int
        Runs at a time, a process each.
    fresh : bool
        Whether to run what is in ``parts`` already, too.
    """

    sequences: Path
    output: Path
    trackers: Sequence[str] = ()
    results: Mapping[str, str] = field(default_factory=dict)
    protocols: Sequence[str] = PROTOCOLS[:1]
    attributes: Path | None = None
    workers: int = 1
    fresh: bool = False


@dataclass(frozen=True, slots=True)
class Outcome:
    """What to tell.

    Attributes
    ----------
    table : str
        Overall figures, in Markdown.
    notes : tuple of str
        What to know of them, a sentence each.
    """

    table: str
    notes: tuple[str, ...]


def evaluate_trackers(plan: Plan) -> Outcome:
    """Run trackers, with a progress bar on stderr, score all boxes, and write the figures.

    Raises
    ------
    SitupError
        If a file cannot be read, trackers are to be run where there are no pictures, or one fails.
    OutputError
        If a file cannot be written.
    """
    targets = load_targets(plan.sequences, plan.attributes)
    _check_pictures(plan, targets)
    read = [read_results(name, place, targets) for name, place in plan.results.items()]
    parts, notes = _run(plan, targets)
    ran = [_of_runs(name, plan.protocols, targets, parts) for name in plan.trackers]
    trackers = [*ran, *(_of_boxes(each, targets) for each in read)]
    evaluation = Evaluation(targets, trackers, plan.protocols)
    notes += [*_missing(evaluation), *([] if can_draw() else [_NO_PLOTS])]
    _write(plan, evaluation, parts, notes)
    tables = [overall_table(evaluation, protocol) for protocol in plan.protocols]
    return Outcome(markdown(tables).removeprefix("# Evaluation\n\n"), tuple(notes))


def _check_pictures(plan: Plan, targets: Sequence[Target]) -> None:
    if plan.trackers and targets[0].folder is None:
        raise SitupError(
            f"{plan.sequences}: no pictures here, only truth as text; leave out --trackers and "
            f"score boxes with --results, or give a folder with NAME/img/."
        )


def _run(plan: Plan, targets: Sequence[Target]) -> tuple[dict[PartName, Part], list[str]]:
    """All parts, and what to know of them."""
    names = [
        PartName(tracker, target.name, protocol)
        for tracker in plan.trackers
        for target in targets
        for protocol in plan.protocols
    ]
    if not names:
        return {}, []
    kept = 0
    with tqdm(total=len(names), unit="run", disable=None, dynamic_ncols=True) as bar:

        def count(was_there: bool) -> None:
            nonlocal kept
            kept += was_there
            bar.update(1)

        folder = plan.output / "parts"
        parts = run_benchmark(
            names, targets, folder, workers=plan.workers, fresh=plan.fresh, on_part=count
        )
    return parts, [_KEPT.format(kept, len(names), folder)] if kept else []


def _of_runs(
    tracker: str,
    protocols: Sequence[str],
    targets: Sequence[Target],
    parts: Mapping[PartName, Part],
) -> TrackerResult:
    scores = {
        protocol: {
            target.name: score_runs(parts[PartName(tracker, target.name, protocol)].runs, target)
            for target in targets
        }
        for protocol in protocols
    }
    speeds = {}
    for target in targets:
        runs = [run for p in protocols for run in parts[PartName(tracker, target.name, p)].runs]
        speeds[target.name] = sum(len(run.boxes) for run in runs) / sum(r.seconds for r in runs)
    return TrackerResult(tracker, "run here", scores, speeds)


def _of_boxes(results: ForeignResults, targets: Sequence[Target]) -> TrackerResult:
    scores = {
        target.name: pooled_scores([evaluate_one_pass(boxes, target.truth)])
        for target in targets
        if (boxes := results.boxes.get(target.name)) is not None
    }
    return TrackerResult(results.name, f"boxes read from {results.place}", {"ope": scores})


def _missing(evaluation: Evaluation) -> list[str]:
    """Trackers whose means are over fewer targets than those of others."""
    notes = []
    names = evaluation.names
    for tracker in evaluation.trackers:
        for protocol, scores in tracker.scores.items():
            missing = [name for name in names if name not in scores]
            if missing:
                told = ", ".join(missing[:3]) + (" …" if len(missing) > 3 else "")
                common = len(evaluation.common(protocol))
                notes.append(
                    f"{tracker.name} has no boxes of {len(missing)} of {len(names)} targets "
                    f"({told}); its means without them stand in brackets. The set 'common', and "
                    f"the plots, are of the {common} targets that all trackers have."
                )
    return notes


def _write(
    plan: Plan, evaluation: Evaluation, parts: Mapping[PartName, Part], notes: Sequence[str]
) -> None:
    for name, part in parts.items():
        if name.protocol == "ope":
            lines = [",".join(f"{number:.10g}" for number in box) for box in part.runs[0].boxes]
            path = plan.output / "boxes" / folder_name(name.tracker) / f"{name.target}.txt"
            write_whole(path, "\n".join(lines) + "\n")
    tables = evaluation_tables(evaluation)
    write_whole(plan.output / "tables.md", markdown(tables, notes))
    write_whole(plan.output / "tables.tex", latex(tables))
    if can_draw():
        for protocol in plan.protocols:
            draw_curves(evaluation, protocol, plan.output)
    document = evaluation_document(evaluation)
    write_whole(plan.output / "evaluation.json", json.dumps(document, indent=2) + "\n")
