"""``situp-annotate evaluate``: measure trackers the way the field does."""

from itertools import chain
from pathlib import Path

import click

__all__ = ["evaluate"]


def _names(
    _context: click.Context, _parameter: click.Parameter, values: tuple[str, ...]
) -> tuple[str, ...]:
    """Names apart, except that of a tracker with its model files."""
    split = [[value] if ":" in value else value.split(",") for value in values]
    names = (name.strip() for name in chain.from_iterable(split))
    return tuple(dict.fromkeys(name for name in names if name))


def _places(
    _context: click.Context, _parameter: click.Parameter, values: tuple[str, ...]
) -> dict[str, str]:
    places: dict[str, str] = {}
    for value in values:
        name, equals, place = value.partition("=")
        if not (name.strip() and equals and place):
            raise click.BadParameter(f"{value!r}: give NAME=FOLDER.")
        if name in places:
            raise click.BadParameter(f"{name!r} is given twice; names must differ.")
        places[name] = place
    return places


def _check(trackers: tuple[str, ...], results: dict[str, str], protocols: tuple[str, ...]) -> None:
    from situp_annotate.errors import TrackingError
    from situp_annotate.trackers import find_tracker

    if not trackers and not results:
        raise click.UsageError("Nothing to evaluate: give --trackers, --results or both.")
    for name in trackers:
        try:
            find_tracker(name)
        except TrackingError as error:
            raise click.UsageError(str(error)) from error
        if name in results:
            raise click.UsageError(f"--results {name}=…: a tracker that is run has this name.")
    if not trackers and protocols != ("ope",):
        raise click.UsageError("--protocol tre and sre need trackers to run: give --trackers.")
    if results and "ope" not in protocols:
        raise click.UsageError("--results are scored by one pass: add --protocol ope.")


@click.command(short_help="Measure trackers on sequences with known boxes.")
@click.argument("sequences", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--output",
    "-o",
    type=click.Path(file_okay=False, path_type=Path),
    required=True,
    help="Folder that gets figures, tables, plots and boxes. Finished runs stay in its parts/, "
    "from which an evaluation that was interrupted goes on.",
)
@click.option(
    "--trackers",
    multiple=True,
    callback=_names,
    metavar="NAME,…",
    help="Trackers to run: mosse, csk, kcf, dcf, samf, dsst, fdsst, situp, aspect, accurate, fast; "
    "one of these with settings, such as situp:scale_criterion=max,padding=3; OpenCV's mil; "
    "vit:MODEL, nano:BACKBONE,NECKHEAD or dasiamrpn:MODEL,KERNEL_CLS1,KERNEL_R1 with files of "
    "yours; and those that other packages bring. May be given several times.",
)
@click.option(
    "--results",
    multiple=True,
    callback=_places,
    metavar="NAME=FOLDER",
    help="Boxes of another tracker, to be called NAME: a folder with a file a target (NAME.txt, "
    "NAME_TRACKER.txt or .mat), or the name of files beside each truth, without .txt. Several "
    "times for several trackers.",
)
@click.option(
    "--protocol",
    "protocols",
    multiple=True,
    type=click.Choice(["ope", "tre", "sre"]),
    default=["ope"],
    show_default=True,
    help="One pass, temporal or spatial robustness; several times for several.",
)
@click.option(
    "--attributes",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="JSON file with attributes and sets of the sequences, instead of attributes.json beside "
    "them.",
)
@click.option(
    "--workers",
    "-w",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    help="Runs at a time, one process each; with more than there are free cores, speeds suffer.",
)
@click.option("--fresh", is_flag=True, help="Run anew what is in parts/ already.")
def evaluate(
    sequences: Path,
    output: Path,
    trackers: tuple[str, ...],
    results: dict[str, str],
    protocols: tuple[str, ...],
    attributes: Path | None,
    workers: int,
    fresh: bool,
) -> None:
    """Measure trackers on SEQUENCES, whose true boxes are known, with the OTB toolkit's rules.

    SEQUENCES is a folder with sequences in OTB layout: NAME/img/ and NAME/groundtruth_rect.txt
    with a line x, y, width, height for each frame, counted from 1; or text only, with
    ground_truth/NAME.txt, where boxes of --results are scored.

    \b
      situp-annotate evaluate sequences --trackers situp --output scores --workers 2
      situp-annotate evaluate otb100 --results kcf=results/KCF --output scores
    """
    from situp_annotate.cli._signals import stopped_by_signals
    from situp_annotate.evaluation.evaluation_files import Plan, evaluate_trackers

    protocols = tuple(dict.fromkeys(protocols))
    _check(trackers, results, protocols)
    plan = Plan(
        sequences, output, trackers, results, protocols, attributes, workers=workers, fresh=fresh
    )
    with stopped_by_signals():
        outcome = evaluate_trackers(plan)
    for note in outcome.notes:
        click.echo(note, err=True)
    click.echo(outcome.table, nl=False)
