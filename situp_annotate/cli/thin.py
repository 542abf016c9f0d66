"""``situp-annotate thin``: a manifest with the fewest keyframes that give a run's labels back."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from situp_annotate.errors import EXIT_FAILED, OutputError, SitupError
from situp_annotate.formats.disk import is_there

if TYPE_CHECKING:
    from situp_annotate.finished.thinned import ThinnedVideo
    from situp_annotate.types import VideoJob

__all__ = ["thin"]

_HEADER = (
    *("video", "status", "tracks", "boxes", "keyframes", "per 100 frames"),
    *("mean IoU", "least IoU"),
)


def _refuse(output: Path, manifest: Path, *, overwrite: bool) -> None:
    present = is_there(output)
    if present and output.samefile(manifest):
        raise OutputError(
            f"{output}: this is the manifest to be thinned, which would be lost; choose another "
            "with --output."
        )
    if present and not overwrite:
        raise OutputError(
            f"{output}: there is a file already; choose another with --output, or give "
            "--overwrite to lose it."
        )


def _thin_all(jobs: "Sequence[VideoJob]", out: Path, iou: float) -> "list[ThinnedVideo | None]":
    """Thin each video; tell of those that have to stay as they are, for which None stands."""
    from tqdm import tqdm

    from situp_annotate.finished.thinned import thin_video

    results: list[ThinnedVideo | None] = []
    for job in tqdm(jobs, unit="video", leave=False, disable=None):
        try:
            results.append(thin_video(job, out, iou=iou))
        except SitupError as error:
            results.append(None)
            click.echo(f"{job.id} stays as it is: {error}", err=True)
    return results


def _row(job: "VideoJob", thinned: "ThinnedVideo | None") -> tuple[str, ...]:
    if thinned is None:
        return (job.id, "as it was", str(len(job.tracks)), *["–"] * 5)
    shown: tuple[str, ...] = ("–", "–", "–")
    if thinned.mean_overlap is not None and thinned.least_overlap is not None:
        rate = 100 * thinned.keyframes / thinned.boxes
        shown = (f"{rate:.1f}", f"{thinned.mean_overlap:.3f}", f"{thinned.least_overlap:.3f}")
    counts = (len(job.tracks), thinned.boxes, thinned.keyframes)
    return (job.id, "thinned", *map(str, counts), *shown)


def _from_home(job: "VideoJob", folder: Path) -> "VideoJob":
    """The job with a path that does not depend on where the command was started."""
    if not job.path.is_relative_to(folder):
        return job
    return replace(job, path=folder.resolve() / job.path.relative_to(folder))


@click.command(short_help="Keep the fewest keyframes that give a run's labels back.")
@click.argument("manifest", type=click.Path(path_type=Path))
@click.argument("out", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--output",
    "-o",
    type=click.Path(dir_okay=False, path_type=Path),
    help="The manifest to write; thinned.json beside MANIFEST if not given.",
)
@click.option(
    "--iou",
    type=click.FloatRange(min=0, min_open=True, max=1),
    default=0.9,
    show_default=True,
    help="What every interpolated box overlaps the run's box by, at least: intersection over "
    "union.",
)
@click.option("--overwrite", is_flag=True, help="Replace the manifest to write if it is there.")
@click.option(
    "--allow-outside",
    is_flag=True,
    help="Accept videos outside the manifest's folder: absolute paths, '..', symbolic links.",
)
def thin(
    manifest: Path,
    out: Path,
    output: Path | None,
    iou: float,
    overwrite: bool,
    allow_outside: bool,
) -> None:
    """Write a manifest with as few keyframes as can be, for the boxes that a run has found.

    MANIFEST is what the run was given, OUT its output folder. Every track gets its own boxes,
    those that you drew among them, at the fewest frames from which straight lines come as near
    to all others as --iou demands. Where its boxes end before the video does, it is outside.
    Correct what you like in the new manifest, and let `run` interpolate it.

    \b
      situp-annotate run clips/manifest.json --output out
      situp-annotate thin clips/manifest.json out
      situp-annotate run clips/thinned.json --output final

    Exit codes: 0 when every video is thinned, 1 when one could not be and stays as it is, 3 when
    the manifest is not valid, 5 when the new one is already there or cannot be written.
    """
    from situp_annotate.cli._table import table_lines
    from situp_annotate.formats.manifest import dump_manifest, load_manifest
    from situp_annotate.formats.staging import write_whole

    output = output or manifest.parent / "thinned.json"
    jobs = load_manifest(manifest, allow_outside=allow_outside).jobs
    _refuse(output, manifest, overwrite=overwrite)
    results = _thin_all(jobs, out, iou)
    thinned = [result for result in results if result]
    if not thinned:
        raise SitupError(f"{out}: no video of {manifest} is thinned, so nothing is written.")
    home = output.parent.resolve()
    written = [
        _from_home(result.job if result else job, manifest.parent)
        for job, result in zip(jobs, results, strict=True)
    ]
    write_whole(output, dump_manifest(written, home))
    for line in table_lines([_HEADER, *map(_row, jobs, results)]):
        click.echo(line)
    keyframes, boxes = sum(r.keyframes for r in thinned), sum(r.boxes for r in thinned)
    click.echo(
        f"{len(thinned)} of {len(jobs)} videos thinned: {keyframes} keyframes for {boxes} boxes; "
        f"they are in {output}."
    )
    if any(not job.path.resolve().is_relative_to(home) for job in written):
        click.echo(f"Some videos lie outside {home}: give run --allow-outside.", err=True)
    if len(thinned) < len(jobs):
        raise click.exceptions.Exit(EXIT_FAILED)
