"""``situp-annotate export``: the labels of a run in the formats of other tools."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from situp_annotate.cli._finished import chosen_folders, run_argument, videos_option
from situp_annotate.errors import OutputError
from situp_annotate.formats.disk import is_there

if TYPE_CHECKING:
    from situp_annotate.formats.labelled import LabelledVideo

__all__ = ["export"]

_FORMATS = ("cvat", "cvat-mot", "mot", "mot-gt", "label-studio", "coco", "yolo", "csv")


def _read_all(folders: Sequence[Path], name: str) -> "Iterator[LabelledVideo]":
    """Read one video after the other, with a progress bar."""
    from tqdm import tqdm

    from situp_annotate.results import read_video

    bar: Iterable[Path] = tqdm(folders, desc=name, unit="video", leave=False, disable=None)
    return map(read_video, bar)


@click.command(short_help="Write a run's labels in the formats of other tools.")
@run_argument
@click.option(
    "--format",
    "-f",
    "names",
    type=click.Choice(_FORMATS),
    multiple=True,
    required=True,
    help="What to write; may be given several times.",
)
@click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("exported"),
    show_default=True,
    help="Folder that gets a folder for each format.",
)
@videos_option
@click.option(
    "--iou",
    type=click.FloatRange(min=0, min_open=True, max=1),
    default=0.9,
    show_default=True,
    help="For cvat and label-studio, which get keyframes: what every interpolated box overlaps "
    "the label by, at least.",
)
@click.option(
    "--lost",
    is_flag=True,
    help="Export the boxes of lost objects, too; they only say where it was searched.",
)
@click.option("--images", is_flag=True, help="For yolo: write the pictures beside the labels.")
@click.option("--overwrite", is_flag=True, help="Replace exports that are already there.")
def export(
    out: Path,
    names: tuple[str, ...],
    output: Path,
    video_ids: tuple[str, ...],
    iou: float,
    lost: bool,
    images: bool,
    overwrite: bool,
) -> None:
    """Write the labels of a run, of which OUT is the output folder, for other tools.

    \b
      cvat          CVAT for video 1.1 XML, with as few keyframes as can be
      cvat-mot      CVAT's MOT 1.1 zip, a box in every frame
      mot           MOTChallenge results, a text file a video
      mot-gt        MOTChallenge ground truth with seqinfo.ini, a folder a video
      label-studio  Label Studio predictions, with as few keyframes as can be
      coco          COCO with videos and tracks, one JSON file
      yolo          Ultralytics' layout for training
      csv           everything that is known of each box, one table

    \b
      situp-annotate export out --format cvat
      situp-annotate export out --format coco --format yolo --images --output training

    Exit codes: 0 when all is written, 1 when OUT is not what a run writes, 5 when the output is
    already there or cannot be written.
    """
    from situp_annotate.formats.export_options import ExportOptions
    from situp_annotate.formats.exporting import EXPORTERS
    from situp_annotate.formats.staging import staged_entries
    from situp_annotate.results import run_folders
    from situp_annotate.types import State

    states = (State.VISIBLE, State.OCCLUDED, *([State.LOST] if lost else []))
    options = ExportOptions(iou=iou, states=states, images=images)
    folders = chosen_folders(out, video_ids)
    for name in dict.fromkeys(names):
        place = output / name
        if is_there(place) and place.resolve() in {each.resolve() for each in run_folders(out)}:
            raise OutputError(f"{place}: this is a folder of the run; choose another --output.")
        with staged_entries(place, overwrite=overwrite) as staging:
            EXPORTERS[name](_read_all(folders, name), staging, options)
        click.echo(f"{name}: {len(folders)} videos in {place}")
