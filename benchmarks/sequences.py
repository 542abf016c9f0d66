"""How well ``situp-annotate run`` follows targets whose true boxes are known.

    python benchmarks/sequences.py --sequences FOLDER --json FILE

FOLDER holds sequences in OTB layout (``NAME/img/``, ``NAME/groundtruth_rect*.txt``). Each is
seeded with the truth's first box, put through the real command, and its ``mot.csv`` is scored
with the conventions of the OTB toolkit. Where boxes of another run stand beside the truth
(``situp_authors*.txt``), they are scored too, and how much both overlap.
"""

import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
import numpy.typing as npt

from situp_annotate.evaluation import (
    OtbSequence,
    OtbTarget,
    evaluate_one_pass,
    find_sequences,
    overlaps,
    read_boxes,
)
from situp_annotate.formats.manifest import dump_manifest
from situp_annotate.formats.mot.rows import read_mot
from situp_annotate.types import Keyframe, Track, VideoJob

_REFERENCE = "situp_authors"


@dataclass(frozen=True)
class Score:
    """Figures of one target; ``reference_*`` are None without boxes to compare with."""

    auc: float
    precision: float
    reference_auc: float | None = None
    reference_overlap: float | None = None


def job_of(sequence: OtbSequence) -> VideoJob:
    """Seed every target of a sequence with its first true box."""
    tracks = tuple(
        Track(number, target.name, (Keyframe(0, target.first_box),))
        for number, target in enumerate(sequence.targets, start=1)
    )
    return VideoJob(sequence.name, sequence.folder.resolve(), tracks)


def run(sequences: list[OtbSequence], output: Path) -> None:
    """Put the sequences through the command that users run."""
    manifest = output.with_suffix(".json")
    manifest.write_text(dump_manifest([job_of(sequence) for sequence in sequences], output))
    command = [
        sys.executable,
        "-m",
        "situp_annotate",
        "run",
        str(manifest),
        "--output",
        str(output),
    ]
    # The toolkit scores a box in every frame, those of lost targets too.
    states = 'mot.states=["visible", "occluded", "lost"]'
    options = ["--recipe", "csv_only", "--set", "tracker.preset=situp", "--set", states]
    subprocess.run([*command, *options, "--allow-outside"], check=True)


def boxes_of(path: Path, track_id: int, frames: int) -> npt.NDArray[np.float64]:
    """Boxes of one track, counted from 1 as the truth is; NaN in frames without."""
    boxes = np.full((frames, 4), np.nan)
    for row in read_mot(path):
        if row.track_id == track_id and row.frame < frames:
            box = row.box
            boxes[row.frame] = (box.x + 1, box.y + 1, box.width, box.height)
    return boxes


def score(boxes: npt.NDArray[np.float64], sequence: OtbSequence, target: OtbTarget) -> Score:
    """Score one target's boxes against the truth, and beside the reference's if there is one."""
    result = evaluate_one_pass(boxes, target.truth)
    suffix = target.name.removeprefix(sequence.name)
    path = sequence.folder / f"{_REFERENCE}{suffix}.txt"
    if not path.exists():
        return Score(result.auc, result.precision)
    reference = read_boxes(path)[: len(boxes)]
    shared = overlaps(boxes[: len(reference)], reference)
    return Score(
        result.auc,
        result.precision,
        evaluate_one_pass(reference, target.truth).auc,
        float(np.nanmean(shared)),
    )


def mean(values: list[float]) -> float | None:
    """Mean, or None of nothing."""
    return float(np.mean(values)) if values else None


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path), required=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
def main(sequences: Path, json_path: Path) -> None:
    """Run, score, print a table and write the figures."""
    found = find_sequences(sequences)
    scores: dict[str, Score] = {}
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "out"
        run(found, output)
        for sequence in found:
            for track_id, target in enumerate(sequence.targets, start=1):
                path = output / sequence.name / "mot.csv"
                boxes = boxes_of(path, track_id, len(target.truth))
                scores[target.name] = score(boxes, sequence, target)
    print(f"{'target':18} {'AUC':>6} {'prec.':>6} {'ref. AUC':>9} {'overlap':>8}")
    for name, each in scores.items():
        figures = (each.auc, each.precision, each.reference_auc, each.reference_overlap)
        cells = ["–" if figure is None else f"{figure:.3f}" for figure in figures]
        print(f"{name:18} {cells[0]:>6} {cells[1]:>6} {cells[2]:>9} {cells[3]:>8}")
    compared = [each for each in scores.values() if each.reference_auc is not None]
    bars = {
        "mean_auc": mean([each.auc for each in scores.values()]),
        "mean_auc_of_compared": mean([each.auc for each in compared]),
        "mean_auc_of_reference": mean([each.reference_auc or 0.0 for each in compared]),
    }
    print(json.dumps(bars, indent=2))
    targets = {name: vars(each) for name, each in scores.items()}
    json_path.write_text(json.dumps({"bars": bars, "targets": targets}, indent=2) + "\n")


if __name__ == "__main__":
    main()
