"""``situp-annotate check``: everything that is wrong with a manifest and its videos."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from situp_annotate.cli._inspection import Inspection, inspect_videos
from situp_annotate.errors import EXIT_FAILED

if TYPE_CHECKING:
    from situp_annotate.types import BoundingBox, Keyframe, VideoJob

__all__ = ["check"]


def _keyframe_problem(keyframe: "Keyframe", seen: Inspection) -> str | None:
    if keyframe.frame >= seen.frame_count:
        counted = f"{_count(seen.frame_count, 'frame')}, 0 to {seen.frame_count - 1}"
        return f"past the end; the video has {counted}."
    box, info = keyframe.box, seen.info
    if box and info and not box.intersects(info.width, info.height):
        return f"the box {_show_box(box)} lies wholly outside the {seen.size} picture."
    return None


def _keyframe_note(keyframe: "Keyframe", seen: Inspection) -> str | None:
    box, info = keyframe.box, seen.info
    if box is None or info is None:
        return None
    within = box.x >= 0 and box.y >= 0 and box.right <= info.width and box.bottom <= info.height
    return None if within else f"the box {_show_box(box)} reaches beyond the {seen.size} picture."


def _show_box(box: "BoundingBox") -> str:
    return f"[{box.x:g}, {box.y:g}, {box.width:g}, {box.height:g}]"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _remarks(job: "VideoJob", seen: Inspection) -> tuple[list[str], list[str]]:
    problems = [str(seen.error)] if seen.error else []
    notes = [finding.message for finding in seen.findings]
    if seen.frame_count == 0:
        return problems, notes  # nothing to hold the boxes against
    for track in job.tracks:
        for keyframe in track.keyframes:
            place = f'track {track.id} ("{track.label}"), frame {keyframe.frame}'
            if problem := _keyframe_problem(keyframe, seen):
                problems.append(f"{place}: {problem}")
            elif note := _keyframe_note(keyframe, seen):
                notes.append(f"{place}: {note}")
    return problems, notes


def _headline(job: "VideoJob", seen: Inspection) -> str:
    facts = [f"{job.id}: {job.path}"]
    if seen.info:
        facts += [seen.size, _count(seen.frame_count, "frame")]
        facts.append(f"{float(seen.info.frame_rate):.6g} frames/s")
    facts.append(_count(len(job.tracks), "track"))
    return ", ".join(facts)


@click.command(short_help="Check a manifest and decode every video in it.")
@click.argument("manifest", type=click.Path(path_type=Path))
@click.option(
    "--allow-outside",
    is_flag=True,
    help="Accept videos outside the manifest's folder: absolute paths, '..', symbolic links.",
)
def check(manifest: Path, allow_outside: bool) -> None:
    """Check MANIFEST and decode every video in it, and report all that is wrong at once.

    Problems are what would make `run` fail or ignore a box: videos that are missing, damaged or
    cut short, keyframes past the end, boxes outside the picture. Notes are worth a look.

    \b
      situp-annotate check clips/manifest.json

    Exit codes: 0 when there is no problem, 1 when a video has one, 3 when the manifest is not
    valid (then no video is opened).
    """
    from situp_annotate.formats.manifest import load_manifest

    jobs = load_manifest(manifest, allow_outside=allow_outside).jobs
    inspections = list(inspect_videos([job.path for job in jobs]))
    bad = 0
    for job, seen in zip(jobs, inspections, strict=True):
        problems, notes = _remarks(job, seen)
        bad += bool(problems)
        click.echo(_headline(job, seen) + ("" if problems else ": fine"))
        for kind, remarks in (("problem", problems), ("note", notes)):
            for remark in remarks:
                click.echo(f"  {kind}: {remark}")
    click.echo(f"{_count(len(jobs), 'video')}: {len(jobs) - bad} fine, {bad} with problems.")
    if bad:
        raise click.exceptions.Exit(EXIT_FAILED)
