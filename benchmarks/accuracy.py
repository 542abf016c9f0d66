"""How accurate and how fast the trackers of the family are.

    python benchmarks/accuracy.py --sequences FOLDER --json FILE [--attributes FILE]
        [--trackers NAME …] [--fresh]

FOLDER holds sequences in OTB layout. Each preset, and each with a pool of scales by all criteria,
starts from the truth's first box of each target and is scored by one-pass evaluation with the
conventions of the OTB toolkit, one run after the other in a process of one thread; finished runs
stay in a folder beside FILE, from which a benchmark that was interrupted goes on. Speeds are of
tracking alone, geometric means over the targets. published.json has what others published of OTB
targets, to compare with.
"""

import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import click

from situp_annotate.evaluation.evaluation_files import Plan, evaluate_trackers
from situp_annotate.trackers import PRESETS

SCALE_VARIATION = "SV"
REFERENCE = "situp"
BY_CRITERION = tuple(
    f"{name}:scale_criterion={criterion}"
    for name, preset in PRESETS.items()
    if len(preset.params.pool) > 1
    for criterion in ("apce", "max", "psr")
    if criterion != preset.params.scale_criterion
)
"""Trackers with a pool of scales, by the criteria that are not their own."""

_PUBLISHED = Path(__file__).with_name("published.json")
_MEASURES: Mapping[str, Callable[[Mapping[str, Any]], float]] = {
    "auc": lambda target: float(target["auc"]),
    "success_at_half": lambda target: float(target["success_curve"][10]),
}
_NEAR = 0.05

Trackers = Mapping[str, Mapping[str, Any]]


def figures_of(tracker: Mapping[str, Any]) -> dict[str, float]:
    """Means over all targets, over those whose scale varies, and speed."""
    overall = tracker["ope"]["sets"]["all"]
    figures = {"auc": overall["auc"], "precision": overall["precision"]}
    varied = tracker["ope"]["attributes"].get(SCALE_VARIATION)
    if varied is not None:
        figures["auc_of_scale_variation"] = varied["auc"]
    return {**figures, "fps": tracker["frames_per_second"]}


def by_tracker(trackers: Trackers) -> Iterable[str]:
    """Overall figures, in Markdown."""
    figures = {name: figures_of(tracker) for name, tracker in trackers.items()}
    keys = list(next(iter(figures.values())))
    yield f"| tracker | {' | '.join(keys)} | ÷ {REFERENCE} |"
    yield "|---" * (len(keys) + 2) + "|"
    reference = figures.get(REFERENCE, {}).get("fps")
    for name, each in figures.items():
        cells = [f"{each[key]:.0f}" if key == "fps" else f"{each[key]:.3f}" for key in keys]
        ratio = f"{each['fps'] / reference:.2f}" if reference else ""
        yield f"| {name} | {' | '.join(cells)} | {ratio} |"


def by_target(trackers: Trackers) -> Iterable[str]:
    """AUC by target and preset, in Markdown."""
    names = [name for name in trackers if ":" not in name]
    yield f"| AUC | {' | '.join(names)} |"
    yield "|---" * (len(names) + 1) + "|"
    for target in next(iter(trackers.values()))["ope"]["targets"]:
        aucs = [trackers[name]["ope"]["targets"][target]["auc"] for name in names]
        yield f"| {target} | {' | '.join(f'{auc:.3f}' for auc in aucs)} |"


def published_runs() -> list[tuple[str, str, Mapping[str, float]]]:
    """Tracker, measure and figures by target, of every published run."""
    runs = json.loads(_PUBLISHED.read_bytes())
    return [
        (tracker, measure, run[measure])
        for tracker, of_tracker in runs.items()
        for run in of_tracker
        for measure in _MEASURES
        if measure in run
    ]


def beside_published(trackers: Trackers) -> Iterable[str]:
    """Ours and published figures by target, in Markdown, and how many are how near."""
    runs = [run for run in published_runs() if run[0] in trackers]
    yield f"| ours / published | {' | '.join(f'{name} {measure}' for name, measure, _ in runs)} |"
    yield "|---" * (len(runs) + 1) + "|"
    near = [0] * len(runs)
    known = [0] * len(runs)
    for target in next(iter(trackers.values()))["ope"]["targets"]:
        cells = []
        for number, (name, measure, figures) in enumerate(runs):
            cells.append("")
            if target in figures:
                ours = _MEASURES[measure](trackers[name]["ope"]["targets"][target])
                cells[-1] = f"{ours:.3f} / {figures[target]:.3f}"
                known[number] += 1
                near[number] += abs(ours - figures[target]) <= _NEAR
        if any(cells):
            yield f"| {target} | {' | '.join(cells)} |"
    shares = [f"{one} of {all_}" for one, all_ in zip(near, known, strict=True)]
    yield f"| **within {_NEAR}** | {' | '.join(shares)} |"


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path), required=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
@click.option("--attributes", type=click.Path(exists=True, path_type=Path))
@click.option("--trackers", multiple=True, help="instead of all; may be given several times")
@click.option("--fresh", is_flag=True, help="Run anew what is there from before.")
def main(
    sequences: Path,
    json_path: Path,
    attributes: Path | None,
    trackers: tuple[str, ...],
    *,
    fresh: bool,
) -> None:
    """Run, score, print a table and write the figures."""
    folder = json_path.with_suffix(".evaluation")
    names = trackers or (*PRESETS, *BY_CRITERION)
    plan = Plan(sequences, folder, names, attributes=attributes, fresh=fresh)
    for note in evaluate_trackers(plan).notes:
        print(note)
    found = json.loads((folder / "evaluation.json").read_bytes())["trackers"]
    print("\n".join([*by_tracker(found), "", *by_target(found), "", *beside_published(found)]))
    bars = {name: figures_of(tracker) for name, tracker in found.items()}
    targets = {
        name: {target: {"auc": each["auc"], "precision": each["precision"]}
               for target, each in tracker["ope"]["targets"].items()}
        for name, tracker in found.items()
    }  # fmt: skip
    json_path.write_text(json.dumps({"bars": bars, "targets": targets}, indent=2) + "\n")


if __name__ == "__main__":
    main()
