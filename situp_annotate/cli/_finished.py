"""What the commands that look at a finished run share."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from situp_annotate.errors import EXIT_FAILED, DiskError, OutputError, RecipeError, SitupError
from situp_annotate.formats.disk import is_there
from situp_annotate.formats.staging import refuse_existing

if TYPE_CHECKING:
    from situp_annotate.formats.labelled import LabelledVideo
    from situp_annotate.formats.overlay.options import OverlayOptions

__all__ = [
    "chosen_folders",
    "draw_each",
    "drawing_options",
    "frame_bar",
    "overlay_options",
    "refuse_existing",
    "refuse_sources",
    "run_argument",
    "videos_option",
]

_Command = TypeVar("_Command", bound=Callable[..., Any])

run_argument = click.argument("out", type=click.Path(exists=True, file_okay=False, path_type=Path))

videos_option = click.option(
    "--video",
    "video_ids",
    metavar="ID",
    multiple=True,
    help="Only this video of the run; may be given several times.  [default: all]",
)


def drawing_options(command: _Command) -> _Command:
    """Add the options that say what is drawn, for `overlay_options`."""
    recipe = click.option(
        "--recipe",
        "-r",
        metavar="NAME|PATH",
        default="fast",
        show_default=True,
        help="Recipe whose [overlay] says what is drawn.",
    )
    settings = click.option(
        "--set",
        "settings",
        metavar="overlay.KEY=VALUE",
        multiple=True,
        help="Change one value of it, such as overlay.trails=2; may be given several times.",
    )
    return recipe(settings(command))


def overlay_options(recipe: str, settings: Sequence[str]) -> "OverlayOptions":
    """Say what is to be drawn, by the options of a command."""
    from situp_annotate.recipe import load_recipe

    for setting in settings:
        if not setting.strip().startswith("overlay."):
            raise RecipeError(
                f"--set {setting}: nothing is tracked here, so that only settings of the overlay "
                "matter; give overlay.KEY=VALUE."
            )
    return load_recipe(recipe, settings).overlay


def chosen_folders(out: Path, video_ids: Sequence[str]) -> list[Path]:
    """Folders of the chosen videos in the output folder of a run; of all if none is chosen."""
    from situp_annotate.results import run_folders

    folders = run_folders(out)
    by_id = {folder.name: folder for folder in folders}
    for video_id in video_ids:
        if video_id not in by_id:
            known = ", ".join(list(by_id)[:10]) or "none"
            raise SitupError(
                f"{out}: no annotated video has the id {video_id!r}; known are: {known}."
            )
    chosen = [by_id[video_id] for video_id in dict.fromkeys(video_ids)] or list(folders)
    if not chosen:
        raise SitupError(f"{out}: this run has annotated no video.")
    return chosen


def refuse_sources(places: Iterable[Path], out: Path) -> None:
    """Stop before a video that a run has annotated would be replaced, whatever was asked for."""
    from situp_annotate.results import read_job, run_folders

    present = {place.resolve(): place for place in places if is_there(place)}
    for folder in run_folders(out) if present else ():
        try:
            source = read_job(folder).path.resolve()
        except (SitupError, RuntimeError):  # the latter of a symbolic link to itself
            continue  # which is told of when it is drawn
        if source in present:
            raise OutputError(
                f"{present[source]}: this is a video that the run has annotated; choose another "
                "place with --output."
            )


@contextmanager
def frame_bar(video: "LabelledVideo") -> "Iterator[Callable[[], None]]":
    """A progress bar over the frames of a video, on stderr; silent when that is no terminal."""
    from tqdm import tqdm

    with tqdm(
        total=video.frame_count, desc=video.id, unit="frame", leave=False, disable=None
    ) as bar:

        def step() -> None:
            bar.update()

        yield step


def draw_each(
    folders: Sequence[Path],
    draw: "Callable[[LabelledVideo, Callable[[], None]], None]",
    *,
    made: str,
    output: Path,
) -> None:
    """Draw one video after the other, past those that fail, and say in the end what became of it.

    Parameters
    ----------
    folders : sequence of Path
        Folders of the videos in the output folder of a run.
    draw : callable
        Given what the run has found in a video, and what to call after each of its frames.
    made : str
        What is made, in the plural.
    output : Path
        Where it is.
    """
    import time

    from situp_annotate.results import read_video

    started, drawn = time.perf_counter(), 0
    for folder in folders:
        try:
            video = read_video(folder)
            with frame_bar(video) as step:
                draw(video, step)
            drawn += 1
        except DiskError:
            raise
        except SitupError as error:
            click.echo(f"{folder.name} is left out: {error}", err=True)
    elapsed_s = time.perf_counter() - started
    click.echo(
        f"{drawn} of {len(folders)} videos drawn in {elapsed_s:.1f} s; the {made} are in {output}."
    )
    if drawn < len(folders):
        raise click.exceptions.Exit(EXIT_FAILED)
