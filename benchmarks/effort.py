"""How many boxes a person has to draw: a simulated annotator, method by method.

    python benchmarks/effort.py --sequences FOLDER --json FILE

FOLDER holds sequences in OTB layout. The same as ``situp-annotate effort``, and the bars beside.
"""

import json
from pathlib import Path

import click

from situp_annotate.evaluation.contenders import CONTENDERS
from situp_annotate.evaluation.effort import MOST_BOXES
from situp_annotate.evaluation.effort_files import measure_effort
from situp_annotate.evaluation.effort_study import Settings


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path), required=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
@click.option("--plot", type=click.Path(path_type=Path), help="draw recall against boxes")
@click.option("--methods", default=",".join(CONTENDERS), show_default=True)
@click.option("--workers", default=2, show_default=True, help="targets at a time")
@click.option("--most-boxes", default=MOST_BOXES, show_default=True, help="when to give up")
def main(
    sequences: Path, json_path: Path, plot: Path | None, methods: str, workers: int, most_boxes: int
) -> None:
    """Simulate, print the tables and the bars, and write the figures."""
    settings = Settings(tuple(methods.split(",")), most_boxes)
    effort = measure_effort(sequences, json_path, settings, plot=plot, workers=workers)
    print("\n".join(effort.lines))
    print(json.dumps(effort.bars, indent=2))


if __name__ == "__main__":
    main()
