"""How exactly the tracker gives the boxes that SITUP's authors got.

    python benchmarks/fidelity.py --sequences FOLDER --table FILE --json FILE

FOLDER holds sequences in OTB layout; those count that have boxes of the authors' own code beside
the truth (``situp_authors*.txt``, x, y, width, height, counted from 1). FILE is the full
colour-name table that the authors used.

Teacher-forced: before each frame the target is put where the authors had it, and the model has
learnt along their boxes; the tracker must find the same scale and displacement as they did.
Where it does not, the margin says how near a tie it was: by how much the APCE of the authors'
scale falls short of the highest, relatively. Free
running: the tracker is left alone after the first box, with the table and with the built-in
colour names.
"""

import json
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path

import click
import numpy as np
import numpy.typing as npt
from tqdm import tqdm

from situp_annotate.evaluation import (
    OtbSequence,
    OtbTarget,
    evaluate_one_pass,
    find_sequences,
    overlaps,
    read_boxes,
)
from situp_annotate.tracking import Estimate, SitupTracker, TrackerParams
from situp_annotate.types import BoundingBox, Image
from situp_annotate.video import open_video

_EXACT_PIXELS = 0.01

Boxes = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Deviation:
    """A frame in which the teacher-forced tracker chose otherwise than the authors' code."""

    frame: int
    margin: float | None
    box: tuple[float, ...]
    authors: tuple[float, ...]


@dataclass(frozen=True)
class FreeRun:
    """Scores of a free run, and its mean overlap with the authors' boxes."""

    auc: float
    precision: float
    overlap: float


@dataclass(frozen=True)
class Result:
    """Figures of one target."""

    name: str
    frames: int
    deviations: tuple[Deviation, ...]
    authors_auc: float
    table: FreeRun
    builtin: FreeRun

    @property
    def share(self) -> float:
        """Share of frames with exactly the authors' box when teacher-forced."""
        return 1 - len(self.deviations) / self.frames


def box_of(row: npt.NDArray[np.float64]) -> BoundingBox:
    """Box of a row that counts from 1."""
    x, y, width, height = (float(number) for number in row)
    return BoundingBox(x - 1, y - 1, width, height)


def row_of(box: BoundingBox) -> tuple[float, float, float, float]:
    """Row that counts from 1 of a box."""
    return box.x + 1, box.y + 1, box.width, box.height


def same(box: BoundingBox, other: BoundingBox) -> bool:
    """Whether boxes agree as far as the authors printed theirs."""
    return bool(np.allclose(row_of(box), row_of(other), rtol=0, atol=_EXACT_PIXELS))


def teach(
    tracker: SitupTracker, image: Image, printed: BoundingBox
) -> tuple[Estimate, float | None] | None:
    """Let the tracker find the target, then learn where the authors had it.

    Where the tracker agrees, it goes on from its own box: theirs in full precision. The digits
    that they printed would move samples by 1e-8 pixels, which rounds some grey levels otherwise.

    Returns
    -------
    tuple or None
        None if we agree. Otherwise our estimate, and by how much the APCE of the authors' scale
        falls short of ours, relatively; None if their box is not the peak of any scale.
    """
    ours = tracker.locate(image)
    if same(ours.box, printed):
        tracker.update(image)
        return None
    for candidate in tracker.candidates(image):
        if same(candidate.box, printed):
            tracker.learn(image, candidate.box)
            return ours, 1 - candidate.apce / ours.apce
    tracker.learn(image, printed)
    return ours, None


def frames_of(sequence: OtbSequence) -> Iterator[Image]:
    """Decode as ``situp-annotate run`` does."""
    with open_video(sequence.folder) as source:
        for frame in source:
            yield frame.image


def follow_authors(
    sequence: OtbSequence, target: OtbTarget, authors: Boxes, params: TrackerParams
) -> tuple[Deviation, ...]:
    """Teacher-forced run: the frames in which we choose otherwise."""
    tracker, deviations = SitupTracker(params), []
    for index, image in zip(range(len(authors)), frames_of(sequence), strict=False):
        if index == 0:
            tracker.init(image, target.first_box)
            continue
        theirs = box_of(authors[index])
        deviation = teach(tracker, image, theirs)
        if deviation is not None:
            ours, margin = deviation
            deviations.append(Deviation(index, margin, row_of(ours.box), row_of(theirs)))
    return tuple(deviations)


def run_free(
    sequence: OtbSequence, target: OtbTarget, authors: Boxes, params: TrackerParams
) -> FreeRun:
    """Track from the first box on."""
    tracker, rows = SitupTracker(params), []
    for index, image in zip(range(len(authors)), frames_of(sequence), strict=False):
        if index == 0:
            tracker.init(image, target.first_box)
            rows.append(row_of(target.first_box))
        else:
            rows.append(row_of(tracker.update(image).box))
    boxes = np.array(rows)
    score = evaluate_one_pass(boxes, target.truth)
    overlap = float(np.mean(overlaps(boxes, authors[: len(boxes)])))
    return FreeRun(score.auc, score.precision, overlap)


def measure(sequence: OtbSequence, target: OtbTarget, authors: Boxes, table: str) -> Result:
    """Everything about one target."""
    exact = TrackerParams(color_table=table)
    return Result(
        name=target.name,
        frames=len(authors) - 1,
        deviations=follow_authors(sequence, target, authors, exact),
        authors_auc=evaluate_one_pass(authors, target.truth).auc,
        table=run_free(sequence, target, authors, exact),
        builtin=run_free(sequence, target, authors, TrackerParams()),
    )


def jobs_of(folder: Path) -> list[tuple[OtbSequence, OtbTarget, Boxes]]:
    """Targets whose authors' boxes are known."""
    jobs = []
    for sequence in find_sequences(folder):
        for target in sequence.targets:
            path = sequence.folder / f"situp_authors{target.name.removeprefix(sequence.name)}.txt"
            if path.exists():
                jobs.append((sequence, target, read_boxes(path)))
    return jobs


def bars_of(results: list[Result]) -> dict[str, float]:
    """The figures that the project promises to keep."""
    deviations = sum(len(result.deviations) for result in results)
    authors = np.mean([result.authors_auc for result in results])
    return {
        "teacher_forced_share": 1 - deviations / sum(result.frames for result in results),
        "teacher_forced_worst_sequence": min(result.share for result in results),
        "auc_difference": float(np.mean([r.table.auc for r in results]) - authors),
        "auc_difference_builtin_colors": float(np.mean([r.builtin.auc for r in results]) - authors),
    }


def report(results: list[Result]) -> None:
    """Print a Markdown table and the frames that differ."""
    print("| target | frames | exactly the authors' | AUC: authors | table | built-in | overlap |")
    print("|---|---|---|---|---|---|---|")
    for r in results:
        print(
            f"| {r.name} | {r.frames} | {r.share:.2%} | {r.authors_auc:.3f} | {r.table.auc:.3f} "
            f"| {r.builtin.auc:.3f} | {r.table.overlap:.3f} |"
        )
    for r in results:
        for deviation in r.deviations:
            margin = deviation.margin
            shown = "another peak" if margin is None else f"margin {margin:.1e}"
            print(f"{r.name}, frame {deviation.frame}: {shown}")


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path), required=True)
@click.option("--table", type=click.Path(exists=True), required=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
def main(sequences: Path, table: str, json_path: Path) -> None:
    """Measure, print a table and write the figures."""
    jobs = jobs_of(sequences)
    if not jobs:
        raise click.UsageError(f"{sequences}: no sequence here has situp_authors*.txt.")
    with ProcessPoolExecutor() as pool:
        futures = [pool.submit(measure, *job, table) for job in jobs]
        progress = tqdm(as_completed(futures), total=len(futures), unit="target")
        for _ in progress:
            pass
        results = [future.result() for future in futures]
    report(results)
    bars = bars_of(results)
    print(json.dumps(bars, indent=2))
    targets = {result.name: {**asdict(result), "share": result.share} for result in results}
    json_path.write_text(json.dumps({"bars": bars, "targets": targets}, indent=2) + "\n")


if __name__ == "__main__":
    main()
