"""``situp-annotate excerpt``: a few seconds of an overlay as a GIF or WebP."""

from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from situp_annotate.cli._finished import (
    chosen_folders,
    drawing_options,
    frame_bar,
    overlay_options,
    refuse_existing,
    refuse_sources,
    run_argument,
)
from situp_annotate.errors import OutputError

if TYPE_CHECKING:
    from situp_annotate.formats.overlay.animation import AnimationFormat

__all__ = ["excerpt"]


def _form(output: Path) -> "AnimationFormat":
    form = output.suffix.lower().removeprefix(".")
    if form not in ("gif", "webp"):
        raise OutputError(f"{output}: the name must end in .webp or .gif; give such an --output.")
    return cast("AnimationFormat", form)


def _only_video(out: Path, video_id: str | None) -> Path:
    folders = chosen_folders(out, [video_id] if video_id is not None else [])
    if len(folders) > 1:
        names = ", ".join(folder.name for folder in folders[:10])
        raise click.UsageError(f"{out} has several videos; choose one with --video: {names}.")
    return folders[0]


@click.command(short_help="Make a GIF or WebP of a few seconds of a run.")
@run_argument
@click.option("--video", "video_id", metavar="ID", help="The video, if the run has several.")
@click.option(
    "--start",
    "start_s",
    type=click.FloatRange(min=0),
    default=0.0,
    show_default=True,
    help="Second of the video at which to begin.",
)
@click.option(
    "--seconds",
    type=click.FloatRange(min=0, min_open=True, max=60),
    default=5.0,
    show_default=True,
    help="How long.",
)
@click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path, dir_okay=False),
    default=Path("excerpt.webp"),
    show_default=True,
    help="File to write; .gif plays everywhere, .webp is several times smaller.",
)
@click.option(
    "--width",
    type=click.IntRange(min=16, max=3840),
    default=480,
    show_default=True,
    help="In pixels; smaller videos are not made larger.",
)
@click.option(
    "--fps",
    type=click.FloatRange(min=1, max=50),
    default=10.0,
    show_default=True,
    help="Pictures a second, at most.",
)
@drawing_options
@click.option("--overwrite", is_flag=True, help="Replace a file that is already there.")
def excerpt(
    out: Path,
    video_id: str | None,
    start_s: float,
    seconds: float,
    output: Path,
    width: int,
    fps: float,
    recipe: str,
    settings: tuple[str, ...],
    overwrite: bool,
) -> None:
    """Make an animated picture of a few seconds of a run; OUT is its output folder.

    For chats and READMEs, which do not play videos. The video must be where it was.

    \b
      situp-annotate excerpt out --start 3 --seconds 5
      situp-annotate excerpt out --video street --output street.gif --set overlay.trails=1

    Exit codes: 0 when it is made, 1 when the video cannot be read or is shorter, or OUT is not
    what a run writes, 4 when a setting is not valid, 5 when the file is already there or cannot
    be written.
    """
    from situp_annotate.finished.excerpts import make_excerpt
    from situp_annotate.formats.staging import write_whole
    from situp_annotate.results import read_video

    form = _form(output)
    options = overlay_options(recipe, settings)
    folder = _only_video(out, video_id)
    refuse_existing([output], overwrite=overwrite)
    refuse_sources([output], out)
    video = read_video(folder)
    with frame_bar(video) as step:
        content = make_excerpt(
            video,
            options,
            form=form,
            start_s=start_s,
            seconds=seconds,
            width=width,
            frame_rate=fps,
            on_frame=step,
        )
    write_whole(output, content)
    click.echo(f"{video.id}: {len(content) / 1000:.0f} kB in {output}")
