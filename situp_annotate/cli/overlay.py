"""``situp-annotate overlay``: overlay videos of a finished run, drawn once more."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from situp_annotate.cli._finished import (
    chosen_folders,
    draw_each,
    drawing_options,
    overlay_options,
    refuse_existing,
    refuse_sources,
    run_argument,
    videos_option,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from situp_annotate.formats.labelled import LabelledVideo

__all__ = ["overlay"]


def _run_names(out: Path, other: Path) -> tuple[str, str]:
    """What tells two runs apart: their folders' names, or else their paths."""
    names = (out.resolve().name, other.resolve().name)
    return names if names[0] != names[1] else (str(out), str(other))


@click.command(short_help="Draw the overlay videos of a run once more.")
@run_argument
@click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("overlays"),
    show_default=True,
    help="Folder that gets ID.mp4 for each video.",
)
@videos_option
@drawing_options
@click.option(
    "--beside",
    metavar="OTHER_OUT",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Draw what this other run has found in the same videos to the right.",
)
@click.option("--overwrite", is_flag=True, help="Replace overlays that are already there.")
def overlay(
    out: Path,
    output: Path,
    video_ids: tuple[str, ...],
    recipe: str,
    settings: tuple[str, ...],
    beside: Path | None,
    overwrite: bool,
) -> None:
    """Draw the overlay videos of a run once more; OUT is its output folder.

    Nothing is tracked. The labels are those of the run, the pictures come from the videos, which
    must be where they were, and what is drawn is up to [overlay] of a recipe.

    \b
      situp-annotate overlay out --set overlay.trails=2 --set overlay.captions=id
      situp-annotate overlay out --set overlay.below=0.5 --output doubtful
      situp-annotate overlay out --video street --set 'overlay.tracks=["car", 7]'
      situp-annotate overlay out --beside out_of_last_week --output compared

    Exit codes: 0 when all is drawn, 1 when a video could not be or OUT is not what a run writes,
    4 when a setting is not valid, 5 when an overlay is already there or cannot be written.
    """
    from situp_annotate.batch import core_count
    from situp_annotate.finished.redrawing import redraw, redraw_beside
    from situp_annotate.formats.staging import staged_entries
    from situp_annotate.results import read_video

    options = overlay_options(recipe, settings)
    folders = chosen_folders(out, video_ids)
    places = [output / f"{each.name}.mp4" for each in folders]
    refuse_existing(places, overwrite=overwrite)
    refuse_sources(places, out)
    threads = core_count()

    def draw(video: "LabelledVideo", on_frame: "Callable[[], None]") -> None:
        with staged_entries(output, overwrite=True) as staging:
            path = staging / f"{video.id}.mp4"
            if beside is None:
                redraw(video, path, options, threads=threads, on_frame=on_frame)
            else:
                name, other_name = _run_names(out, beside)
                other = (other_name, read_video(beside / video.id))
                redraw_beside(
                    (name, video), other, path, options, threads=threads, on_frame=on_frame
                )

    draw_each(folders, draw, made="overlays", output=output)
