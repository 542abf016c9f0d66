"""``situp-annotate contact-sheet``: each track of a run at a glance."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from situp_annotate.cli._finished import (
    chosen_folders,
    draw_each,
    refuse_existing,
    run_argument,
    videos_option,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from situp_annotate.formats.labelled import LabelledVideo

__all__ = ["contact_sheet"]

_SHEETS = frozenset({"track-*.png"})


@click.command("contact-sheet", short_help="Show each track of a run on one picture.")
@run_argument
@click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("contact_sheets"),
    show_default=True,
    help="Folder that gets a folder for each video, with track-1.png and so on.",
)
@videos_option
@click.option(
    "--steps",
    type=click.IntRange(min=1, max=200),
    default=24,
    show_default=True,
    help="Pictures of a track at regular steps, at most; boxes that you drew come on top.",
)
@click.option("--overwrite", is_flag=True, help="Replace contact sheets that are already there.")
def contact_sheet(
    out: Path, output: Path, video_ids: tuple[str, ...], steps: int, overwrite: bool
) -> None:
    """Show each track of a run on one picture; OUT is the output folder of the run.

    A PNG for each track has the object and what is around it at regular steps and wherever you
    drew a box, with frame, time and confidence. The border is green where the object is visible,
    orange where it is occluded and red where it is lost. The videos must be where they were.

    \b
      situp-annotate contact-sheet out
      situp-annotate contact-sheet out --video street --steps 60

    Exit codes: 0 when all is drawn, 1 when a video could not be or OUT is not what a run writes,
    5 when contact sheets are already there or cannot be written.
    """
    from situp_annotate.batch import core_count
    from situp_annotate.finished.contact_sheets import write_contact_sheets
    from situp_annotate.formats.staging import refuse_foreign, staged_folder

    folders = chosen_folders(out, video_ids)
    places = [output / each.name for each in folders]
    refuse_existing(places, overwrite=overwrite)
    for place in places:
        if place.is_dir():
            refuse_foreign(place, _SHEETS)
    threads = core_count()

    def draw(video: "LabelledVideo", on_frame: "Callable[[], None]") -> None:
        with staged_folder(output / video.id, replaceable=_SHEETS) as folder:
            write_contact_sheets(video, folder, steps=steps, threads=threads, on_frame=on_frame)

    draw_each(folders, draw, made="contact sheets", output=output)
