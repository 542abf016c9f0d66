"""``situp-annotate run``: the main job."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from situp_annotate.errors import EXIT_INTERRUPTED

if TYPE_CHECKING:
    from collections.abc import Callable

    from situp_annotate.progress import BatchProgress

__all__ = ["run"]


@contextmanager
def _progress_bar(videos: int) -> "Iterator[Callable[[BatchProgress], None]]":
    """One bar over all frames of the batch, on stderr; silent when that is not a terminal."""
    from tqdm import tqdm

    with tqdm(unit="frame", disable=None, dynamic_ncols=True) as bar:

        def show(progress: "BatchProgress") -> None:
            bar.total = progress.frames_expected or None
            bar.set_postfix_str(f"{progress.videos_done}/{videos} videos", refresh=False)
            bar.update(progress.frames_done - bar.n)

        yield show


@click.command(short_help="Annotate every video of a manifest.")
@click.argument("manifest", type=click.Path(path_type=Path))
@click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("out"),
    show_default=True,
    help="Folder that gets a folder for each video, report.html and batch.json.",
)
@click.option(
    "--recipe",
    "-r",
    metavar="NAME|PATH",
    default="situp",
    show_default=True,
    help="Ready-made recipe (situp, overlay, csv_only) or path of a TOML file.",
)
@click.option(
    "--set",
    "settings",
    metavar="SECTION.KEY=VALUE",
    multiple=True,
    help="Change one value of the recipe; may be given several times.",
)
@click.option(
    "--workers",
    "-w",
    type=click.IntRange(min=1),
    help="Videos to annotate at a time, one process each; cores left over follow the tracks of a "
    "video side by side.  [default: as many as cores]",
)
@click.option(
    "--executor",
    type=click.Choice(["process", "serial"]),
    default="process",
    show_default=True,
    help="'serial' runs everything in one process, for debugging.",
)
@click.option("--overwrite", is_flag=True, help="Replace outputs that are already there.")
@click.option(
    "--no-cache",
    is_flag=True,
    help="Track everything anew, and keep nothing for the next run. Labels do not depend on it.",
)
@click.option(
    "--allow-outside",
    is_flag=True,
    help="Accept videos outside the manifest's folder: absolute paths, '..', symbolic links.",
)
def run(
    manifest: Path,
    output: Path,
    recipe: str,
    settings: tuple[str, ...],
    workers: int | None,
    executor: str,
    overwrite: bool,
    no_cache: bool,
    allow_outside: bool,
) -> None:
    """Propagate the boxes of MANIFEST through its videos and write the results.

    Each video gets a folder in the output folder, with labels.csv, mot.csv, annotations.mcap,
    overlay.mp4, report.html and more; report.html beside them shows what became of all of them, and
    what is worth a look. A video that fails leaves no folder and does not stop the others.

    After a correction of MANIFEST, run it again with --overwrite: what the tracker said is kept
    in .cache in the output folder, and only what has changed is tracked anew.

    \b
      situp-annotate run clips/manifest.json --output out
      situp-annotate run clips/manifest.json --recipe csv_only --workers 4
      situp-annotate run clips/manifest.json --set tracker.learning_rate=0.01

    Exit codes: 0 when every video is annotated, 1 when one failed, 3 for a manifest and 4 for a
    recipe that is not valid, 5 when the output is already there or cannot be written, 130 when
    interrupted.
    """
    from situp_annotate.batch import annotate_batch
    from situp_annotate.cli._table import summary_lines
    from situp_annotate.compiling import kernels_are_compiled
    from situp_annotate.formats.manifest import load_manifest
    from situp_annotate.recipe import load_recipe

    chosen = load_recipe(recipe, settings)
    jobs = load_manifest(manifest, allow_outside=allow_outside).jobs
    if not kernels_are_compiled():
        click.echo("Compiling the tracker for this machine, once: some twenty seconds.", err=True)
    try:
        with _progress_bar(len(jobs)) as show:
            report = annotate_batch(
                jobs,
                output,
                chosen,
                workers=workers,
                executor="serial" if executor == "serial" else "process",
                overwrite=overwrite,
                cache=not no_cache,
                on_progress=show,
            )
    except KeyboardInterrupt:
        click.echo(
            f"Interrupted: the videos that were complete are in {output}, and batch.json there "
            "names them.",
            err=True,
        )
        raise click.exceptions.Exit(EXIT_INTERRUPTED) from None
    for line in summary_lines(report, output):
        click.echo(line)
    raise click.exceptions.Exit(report.exit_code)
