"""Fit confidence to sequences whose true boxes are known, and say how far it can be trusted.

    python benchmarks/confidence.py --sequences FOLDER --json FILE

FOLDER holds sequences in OTB layout. The simulated annotator draws 1, 2, 3, 5 and 10 boxes, in the
worst frames and in the suggested ones; every other frame is a sample: what was known of its box,
and how well it overlaps the truth. Tracks in both directions and linear interpolation are sampled.
Figures are for tracks, of sequences left out of the fit, one at a time.
``--write`` puts coefficients fitted to all sequences into the package.
"""

import json
from importlib import resources
from pathlib import Path

import click
import numpy as np
import numpy.typing as npt

from situp_annotate.evaluation import find_sequences
from situp_annotate.evaluation.calibration import calibration
from situp_annotate.evaluation.effort_files import parts_folder
from situp_annotate.evaluation.effort_study import Settings, load_samples, run_study
from situp_annotate.evaluation.fitting import fit, predict_left_out
from situp_annotate.evaluation.samples import Samples
from situp_annotate.propagation.confidence import GOOD, PRECISE

_COEFFICIENTS = "confidence.json"

Array = npt.NDArray[np.float64]


def figures_of(samples: Samples, probability: Array) -> dict[str, dict[str, float]]:
    """Figures by picks and boxes drawn."""
    groups = {}
    for pick in np.unique(samples.pick):
        of_pick = samples.pick == pick
        groups[f"{pick}, all"] = of_pick
        for boxes in np.unique(samples.boxes[of_pick]):
            groups[f"{pick}, {boxes} boxes"] = of_pick & (samples.boxes == boxes)
    return {
        name: {
            "samples": int(group.sum()),
            "failures": float(np.mean(samples.overlap[group] < GOOD)),
            **calibration(probability[group], samples.overlap[group])._asdict(),
        }
        for name, group in groups.items()
    }


def report(figures: dict[str, dict[str, float]]) -> None:
    """Print a Markdown table."""
    print("| labels | frames | overlap < 0.5 | AUROC | ECE | failures in the last tenth |")
    print("|---|---|---|---|---|---|")
    for name, each in figures.items():
        print(
            f"| {name} | {each['samples']} | {each['failures']:.1%} | {each['auroc']:.3f} "
            f"| {each['ece']:.3f} | {each['share']:.0%} |"
        )


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path), required=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
@click.option("--workers", default=2, show_default=True, help="targets at a time")
@click.option("--write", is_flag=True, help="put the coefficients into the package")
def main(sequences: Path, json_path: Path, workers: int, *, write: bool) -> None:
    """Simulate, fit, print the tables and write the figures."""
    found = find_sequences(sequences)
    parts = parts_folder(json_path)
    targets = run_study(found, parts, Settings(("both", "linear")), workers=workers)
    names = [target.name for target in targets]
    tracked = load_samples(parts, names)
    samples = Samples.joined([tracked, load_samples(parts, names, "linear")])
    figures = figures_of(tracked, predict_left_out(samples, GOOD)[: len(tracked.overlap)])
    report(figures)
    coefficients = {str(overlap): fit(samples, overlap) for overlap in (GOOD, PRECISE)}
    document = {"coefficients": coefficients}
    print(json.dumps(document, indent=2))
    json_path.write_text(json.dumps({"figures": figures, **document}, indent=2) + "\n")
    if write:
        place = Path(str(resources.files("situp_annotate.propagation"))) / _COEFFICIENTS
        place.write_text(json.dumps(document, indent=2) + "\n")


if __name__ == "__main__":
    main()
