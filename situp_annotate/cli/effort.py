"""``situp-annotate effort``: how many boxes a person has to draw, by simulation."""

from pathlib import Path

import click

__all__ = ["effort"]

_METHODS = ("hold", "linear", "cubic", "mil", "forward", "both", "situp", "accurate")


def _chosen(_context: click.Context, _parameter: click.Parameter, value: str) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(name.strip() for name in value.split(",")))
    for name in names:
        if name not in _METHODS:
            raise click.BadParameter(f"{name!r} is no method; known are {', '.join(_METHODS)}.")
    return names


@click.command(short_help="Simulate how many boxes a person has to draw.")
@click.argument("sequences", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--json",
    "json_path",
    type=click.Path(dir_okay=False, path_type=Path),
    required=True,
    help="File that gets the figures. The results of each target stay in a folder beside it, "
    "FILE.parts, from which a run that was interrupted goes on.",
)
@click.option(
    "--plot",
    type=click.Path(dir_okay=False, path_type=Path),
    help="PNG that gets the curves of recall against boxes; needs the extra [evaluate].",
)
@click.option(
    "--methods",
    callback=_chosen,
    default=",".join(_METHODS),
    show_default=True,
    help="What to compare, separated by commas. both is what run does by default, forward "
    "goes in one direction; situp and accurate go in both with those trackers; mil is OpenCV's "
    "TrackerMIL: slow, and followed up to 3 boxes only.",
)
@click.option(
    "--workers",
    "-w",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    help="Targets to simulate at a time, one process each.",
)
@click.option(
    "--most-boxes",
    type=click.IntRange(min=1),
    default=250,
    show_default=True,
    help="Boxes after which the person gives up on a target.",
)
def effort(
    sequences: Path,
    json_path: Path,
    plot: Path | None,
    methods: tuple[str, ...],
    workers: int,
    most_boxes: int,
) -> None:
    """Simulate a person who annotates the targets of SEQUENCES, and count their boxes.

    SEQUENCES is a folder with sequences in OTB layout: NAME/img/ and NAME/groundtruth_rect.txt
    with a line x, y, width, height for each frame, counted from 1. The person draws the first
    box, corrects one frame after another, the worst or the one that is suggested, and stops when
    95 % of the frames overlap the truth by 0.7. Where they stop before 10 boxes, the recall told
    for more boxes is that at the end.

    \b
      situp-annotate effort sequences --json effort.json --workers 4
      situp-annotate effort sequences --json effort.json --methods linear,both --plot effort.png
    """
    from situp_annotate.evaluation.effort_files import measure_effort
    from situp_annotate.evaluation.effort_study import Settings

    settings = Settings(methods, most_boxes)
    for line in measure_effort(sequences, json_path, settings, plot=plot, workers=workers).lines:
        click.echo(line)
