"""``situp-annotate init``: a manifest to type boxes into, for a folder of videos."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from situp_annotate.cli._inspection import Inspection, inspect_videos
from situp_annotate.cli._shell import shell_word
from situp_annotate.errors import EXIT_FAILED, OutputError, VideoMissingError
from situp_annotate.formats.disk import is_there

if TYPE_CHECKING:
    from situp_annotate.types import VideoInfo

__all__ = ["init"]

_EXAMPLE = """\
Now type boxes in: for each object, put a track into the "tracks" of its video, such as
  {"id": 1, "label": "person", "frame": 0, "box": [x, y, width, height]}
frame counts from 0; the box is in pixels from the top-left corner of the picture. Then:
  situp-annotate check """


def _summary(info: "VideoInfo", frame_count: int) -> dict[str, Any]:
    summary: dict[str, Any] = {"width": info.width, "height": info.height}
    if info.decoder != "images":  # a folder of pictures has no rate of its own
        rate = info.frame_rate
        summary["frame_rate"] = rate.numerator if rate.denominator == 1 else str(rate)
    return summary | {"frames": frame_count}


def _is_sayable(path: Path) -> bool:
    # On Linux a name may be any bytes; those that are no UTF-8 fit neither JSON nor OpenCV.
    try:
        str(path).encode()
    except UnicodeEncodeError:
        return False
    return True


def _inspect_all(found: Sequence[Path]) -> list[tuple[Path, Inspection]]:
    """Decode the videos; tell of those that have to be left out, and return the others."""
    sayable = [path for path in found if _is_sayable(path)]
    reasons = [
        f"{str(path)!a}: the name is not valid UTF-8; rename it."
        for path in found
        if not _is_sayable(path)
    ]
    kept = []
    for path, seen in zip(sayable, inspect_videos(sayable), strict=True):
        if seen.error is None:
            kept.append((path, seen))
        else:
            reasons.append(str(seen.error))
    for reason in reasons:
        click.echo(f"Left out: {reason}", err=True)
    return kept


def _skeleton(videos: Sequence[tuple[Path, Inspection]], folder: Path) -> str:
    from situp_annotate.formats.manifest import dump_manifest
    from situp_annotate.formats.manifest.ids import unique_ids
    from situp_annotate.types import VideoJob

    paths = [path for path, _ in videos]
    inside = [path.relative_to(folder) if path.is_relative_to(folder) else path for path in paths]
    ids = unique_ids([path.as_posix() for path in inside], folder)
    jobs = [VideoJob(video_id, path, ()) for video_id, path in zip(ids, paths, strict=True)]
    info = {
        video_id: _summary(seen.info, seen.frame_count)
        for video_id, (_, seen) in zip(ids, videos, strict=True)
        if seen.info
    }
    return dump_manifest(jobs, folder, info=info)


def _refuse_to_overwrite(output: Path, *, force: bool) -> None:
    if is_there(output) and not force:
        raise OutputError(
            f"{output}: there is a file already; choose another with --output, or give --force "
            "to lose it and the boxes in it."
        )


@click.command(short_help="Write a manifest skeleton for a folder of videos.")
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    help="The manifest to write; FOLDER/manifest.json if not given.",
)
@click.option("--force", is_flag=True, help="Overwrite the manifest if there is one.")
def init(folder: Path, output: Path | None, force: bool) -> None:
    """Write a manifest for the videos in FOLDER and the folders in it, ready for boxes.

    Each video is decoded to its end, since the number of frames that a file claims is often
    wrong. Size, frame rate and number of frames are written as "info" beside each.

    \b
      situp-annotate init clips
      situp-annotate init clips --output night.json --force

    Exit codes: 0 when all videos are in the manifest, 1 when some had to be left out or there
    are none, 5 when the manifest cannot be written or is already there.
    """
    from situp_annotate.formats.staging import write_whole
    from situp_annotate.video import find_videos

    output = output or folder / "manifest.json"
    _refuse_to_overwrite(output, force=force)
    found = find_videos(folder)
    if not found:
        raise VideoMissingError(f"{folder}: there are no videos in this folder; name another.")
    kept = [
        (folder.resolve() / path.relative_to(folder), seen) for path, seen in _inspect_all(found)
    ]
    if not kept:
        raise VideoMissingError(f"{folder}: no video can be decoded, so no manifest is written.")
    _refuse_to_overwrite(output, force=force)  # decoding may have taken hours
    home = output.parent.resolve()
    write_whole(output, _skeleton(kept, home))
    frames = sum(seen.frame_count for _, seen in kept)
    click.echo(
        f"Wrote {output}: {len(kept)} videos, {frames} frames.\n{_EXAMPLE}{shell_word(output)}",
        err=True,
    )
    if any(not path.resolve().is_relative_to(home) for path, _ in kept):
        click.echo(f"Some videos lie outside {home}: give check and run --allow-outside.", err=True)
    if len(kept) < len(found):
        raise click.exceptions.Exit(EXIT_FAILED)
