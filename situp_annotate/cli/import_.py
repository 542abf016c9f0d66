"""``situp-annotate import``: boxes from other tools, as a manifest."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from situp_annotate.cli._finished import refuse_existing
from situp_annotate.cli._shell import shell_word
from situp_annotate.errors import SitupError

if TYPE_CHECKING:
    from situp_annotate.seeding import SeededVideo, VideoFinder
    from situp_annotate.types import VideoJob

__all__ = ["import_"]

_FORMATS = ("cvat", "mot", "label-studio", "coco", "otb")
_EDITABLE = ("cvat", "label-studio")
"""Formats that give back everything that was exported to them."""


def _read(
    files: "Mapping[Path, str]",
    finder: "VideoFinder",
    label: str,
    labels: Path | None,
    pixel_origin: str | None,
) -> "Iterator[SeededVideo]":
    """What all files, of which the formats are given, say; never twice of the same video."""
    from situp_annotate.seeding import import_seeds, read_class_names

    names = read_class_names(labels) if labels else {}
    origin: Literal[0, 1] | None = None if pixel_origin is None else (0, 1)[int(pixel_origin)]
    seen: dict[Path, Path] = {}
    for file, name in files.items():
        for seeded in import_seeds(
            file, finder, name=name, label=label, labels=names, pixel_origin=origin
        ):
            if seeded.path in seen:
                raise SitupError(
                    f"{file}: {seen[seeded.path]} has boxes for {seeded.path} already; import one "
                    "of them, or name the video that is meant with --videos."
                )
            seen[seeded.path] = file
            yield seeded


def _new_jobs(seeded: "Sequence[SeededVideo]", home: Path) -> "list[VideoJob]":
    from situp_annotate.formats.manifest.ids import unique_ids
    from situp_annotate.types import VideoJob

    paths = [Path(os.path.abspath(video.path)) for video in seeded]  # noqa: PTH100 - no links
    names = [path.relative_to(home) if path.is_relative_to(home) else path.name for path in paths]
    ids = unique_ids([Path(name).as_posix() for name in names], home)
    return [
        VideoJob(video_id, path, video.tracks)
        for video_id, path, video in zip(ids, paths, seeded, strict=True)
    ]


def _corrected_jobs(
    seeded: "Sequence[SeededVideo]", run: "Mapping[Path, VideoJob]", iou: float
) -> "list[VideoJob]":
    """The jobs of the run, by their folders, with the corrections; tells what is new in each."""
    from situp_annotate.finished.corrections import correct
    from situp_annotate.results import read_video

    tracks_of = {video.path: video.tracks for video in seeded}
    jobs = []
    for folder, job in run.items():
        if job.path not in tracks_of:
            jobs.append(job)
            continue
        result = correct(tracks_of[job.path], read_video(folder), iou=iou)
        click.echo(
            f"{job.id}: {result.changed} boxes changed or added, {result.added} tracks added, "
            f"{result.removed} removed"
        )
        jobs.append(replace(job, tracks=result.tracks))
    return jobs


def _jobs_of(run: Path) -> "dict[Path, VideoJob]":
    """What a run was given for each video, by its folder; tells of those that have failed."""
    from situp_annotate.results import failed_ids, read_job, run_folders

    for video_id in failed_ids(run):
        click.echo(
            f"{video_id} failed in this run, so that it is not in the new manifest.", err=True
        )
    return {folder: read_job(folder) for folder in run_folders(run)}


def _formats(files: Sequence[Path], name: str | None, *, corrects: bool) -> dict[Path, str]:
    """The format of each file; of corrections only what gives everything back."""
    from situp_annotate.seeding import recognize

    formats = {file: name or recognize(file) for file in files}
    for file, found in formats.items():
        if corrects and found not in _EDITABLE:
            raise SitupError(
                f"{file}: corrections are read from {' or '.join(_EDITABLE)}, which give back all "
                f"that was exported; {found} does not. Export and correct in one of those."
            )
    return formats


@click.command("import", short_help="Make a manifest of boxes from other tools.")
@click.argument(
    "files", nargs=-1, required=True, metavar="FILE...", type=click.Path(path_type=Path)
)
@click.option(
    "--videos",
    "places",
    type=click.Path(exists=True, path_type=Path),
    multiple=True,
    help="A video, or a folder with videos, that the boxes belong to; may be given several times."
    "  [default: the folder of each FILE]",
)
@click.option(
    "--output",
    "-o",
    type=click.Path(dir_okay=False, path_type=Path),
    default=Path("manifest.json"),
    show_default=True,
    help="The manifest to write.",
)
@click.option(
    "--corrects",
    "run",
    metavar="OUT",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="The FILEs are corrected exports of this run, of which OUT is the output folder: keep "
    "what a person drew or changed, and leave the rest to be tracked again.",
)
@click.option(
    "--iou",
    type=click.FloatRange(min=0, min_open=True, max=1),
    default=0.9,
    show_default=True,
    help="With --corrects: what the export was made with.",
)
@click.option(
    "--format",
    "name",
    type=click.Choice(_FORMATS),
    help="Format of the FILEs.  [default: recognized]",
)
@click.option(
    "--label",
    default="object",
    show_default=True,
    help="What the objects are, where a file does not say it.",
)
@click.option(
    "--labels",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Text file with the names of MOT's class numbers, one a line.",
)
@click.option(
    "--pixel-origin",
    type=click.Choice(["0", "1"]),
    help="Coordinate of the picture's top-left corner in mot and otb files.  [default: 0 for "
    "mot, 1 for otb]",
)
@click.option("--overwrite", is_flag=True, help="Replace the manifest to write if it is there.")
def import_(
    files: tuple[Path, ...],
    places: tuple[Path, ...],
    output: Path,
    run: Path | None,
    iou: float,
    name: str | None,
    label: str,
    labels: Path | None,
    pixel_origin: str | None,
    overwrite: bool,
) -> None:
    """Write a manifest with the boxes in each FILE, for `run` to go on from.

    \b
      cvat          CVAT for video 1.1: the XML, or the zip it comes in
      mot           MOTChallenge ground truth, results or detections; CVAT's MOT 1.1 zip
      label-studio  Label Studio's JSON, as exported
      coco          COCO with videos and tracks
      otb           OTB's ground truth, a text file with a box a line

    A video is found by the name that the file gives, or else by the file's own name.

    \b
      situp-annotate import street.xml --videos clips/street.mp4
      situp-annotate import labels/*.xml --videos clips --output clips/manifest.json
      situp-annotate import corrected.xml --corrects out --output corrected.json

    Exit codes: 0 when the manifest is written, 1 when a file is not what it should be or a video
    is not found, 5 when the manifest is already there or cannot be written.
    """
    from situp_annotate.formats.manifest import dump_manifest
    from situp_annotate.formats.staging import write_whole
    from situp_annotate.seeding import VideoFinder

    if run and places:
        raise click.UsageError("--corrects knows where its videos are: leave out --videos.")
    refuse_existing([output], overwrite=overwrite)
    formats = _formats(files, name, corrects=run is not None)
    home = output.parent.resolve()
    known = _jobs_of(run) if run else {}
    ids = {job.id: job.path for job in known.values()}
    finder = VideoFinder([] if run else places or _folders(files), ids)
    seeded = list(_read(formats, finder, label, labels, pixel_origin))
    jobs = _corrected_jobs(seeded, known, iou) if run else _new_jobs(seeded, home)
    write_whole(output, dump_manifest(jobs, home))
    for video in seeded:
        for note in video.notes:
            click.echo(f"{video.origin}: {note}", err=True)
    tracks = sum(len(job.tracks) for job in jobs)
    boxes = sum(len(track.keyframes) for job in jobs for track in job.tracks)
    click.echo(
        f"Wrote {output}: {len(jobs)} videos, {tracks} tracks, {boxes} keyframes. "
        f"Check it: situp-annotate check {shell_word(output)}"
    )
    if any(not job.path.is_relative_to(home) for job in jobs):
        click.echo(f"Some videos lie outside {home}: give check and run --allow-outside.", err=True)


def _folders(files: Sequence[Path]) -> list[Path]:
    return list(dict.fromkeys(file.parent for file in files))
