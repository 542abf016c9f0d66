"""``situp-annotate score``: HOTA, MOTA and IDF1 of what a run has found."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from situp_annotate.evaluation.mot_files import MotOutcome

__all__ = ["score"]

_RATES = ("HOTA", "DetA", "AssA", "LocA", "MOTA", "IDF1")
_COUNTS = ("FP", "FN", "IDSW", "Frag", "MT", "ML")


def _table(outcome: "MotOutcome") -> list[str]:
    from situp_annotate.cli._table import table_lines

    rows = [["video", *_RATES, *_COUNTS, "objects"]]
    for name, scores in [*outcome.videos.items(), ("COMBINED", outcome.combined)]:
        shown = name if name.isprintable() else ascii(name)
        rates = [f"{scores.rates[key]:.3f}" for key in _RATES]
        counts = [str(scores.counts[key]) for key in _COUNTS]
        rows.append([shown, *rates, *counts, str(scores.boxes["truth_objects"])])
    return table_lines(rows)


@click.command(short_help="Score tracks against truth: HOTA, MOTA, IDF1.")
@click.argument("result", type=click.Path(exists=True, path_type=Path))
@click.argument("truth", type=click.Path(exists=True, path_type=Path))
@click.option(
    "--json",
    "json_path",
    type=click.Path(dir_okay=False, path_type=Path),
    help="File that gets all figures.",
)
@click.option(
    "--iou",
    type=click.FloatRange(min=0, min_open=True, max=1),
    default=0.5,
    show_default=True,
    help="Least overlap of a box that counts as found, for MOTA, IDF1 and the counts; HOTA is a "
    "mean over 0.05 to 0.95.",
)
@click.option(
    "--class",
    "classes",
    type=int,
    multiple=True,
    metavar="NUMBER",
    help="Class of the truth that counts; may be given several times.  [default: all]",
)
@click.option(
    "--ignore-class",
    "ignored",
    type=int,
    multiple=True,
    metavar="NUMBER",
    help="Class of truth that may be found or not: neither counts. May be given several times.",
)
@click.option(
    "--result-origin",
    type=click.Choice(["0", "1"]),
    default="0",
    show_default=True,
    help="Coordinate of the picture's top-left corner in RESULT: what mot.pixel_origin was.",
)
@click.option(
    "--truth-origin",
    type=click.Choice(["0", "1"]),
    default="0",
    show_default=True,
    help="The same in TRUTH.",
)
def score(
    result: Path,
    truth: Path,
    json_path: Path | None,
    iou: float,
    classes: tuple[int, ...],
    ignored: tuple[int, ...],
    result_origin: str,
    truth_origin: str,
) -> None:
    """Score the tracks in RESULT against TRUTH, with TrackEval (the extra [mot]).

    RESULT is the output folder of a run, whose videos have mot.csv; a folder with NAME.txt for
    each video; or one MOT file. TRUTH is a MOT file with ground truth, or a folder with NAME.txt
    or NAME/gt/gt.txt for each video. Frames count from 1 in both. Truth with flag 0 is left out.

    \b
      situp-annotate score out truth
      situp-annotate score out/clip/mot.csv gt.txt --json scores.json
      situp-annotate score results MOT17/train --class 1 --ignore-class 2 --ignore-class 7 \\
        --ignore-class 8 --ignore-class 12

    Videos without truth, and truth without a result, are named and not scored. The last row,
    COMBINED, is over the boxes of all videos that are.
    """
    from situp_annotate.evaluation.mot_files import MotPlan, score_files
    from situp_annotate.evaluation.mot_scores import ScoreOptions

    if both := sorted({*classes} & {*ignored}):
        raise click.UsageError(f"--class and --ignore-class both name {both[0]}; choose one.")
    options = ScoreOptions(iou, classes, ignored)
    plan = MotPlan(result, truth, options, int(result_origin), int(truth_origin))
    outcome = score_files(plan, json_path)
    for note in outcome.notes:
        click.echo(note, err=True)
    for line in _table(outcome):
        click.echo(line)
