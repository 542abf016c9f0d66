"""``situp-annotate status``: how far a batch is."""

import json
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from situp_annotate.batch import RunStatus

__all__ = ["status"]

_MOST_FAILURES = 50


@click.command(short_help="Say how far a batch is, running or stopped.")
@click.argument("out", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print JSON, for machines.")
def status(out: Path, as_json: bool) -> None:
    """Say how far the batch in the output folder OUT is: what is done, failed, and going on.

    It only reads, and may be asked at any time, on any machine that sees the folder.

    \b
      situp-annotate status out
      watch situp-annotate status out

    Exit codes: 0, or 1 when no run has begun there.
    """
    from situp_annotate.batch import read_status

    found = read_status(out)
    if as_json:
        text = json.dumps([each.as_dict() for each in found], indent=2, ensure_ascii=False)
        click.echo(text)
        return
    for each in found:
        for line in _lines(each):
            click.echo(line)


def _lines(run: "RunStatus") -> list[str]:
    started = datetime.fromisoformat(run.started_at).astimezone()
    name = f"Shard {run.shard}" if run.shard else "Run"
    where = f" (process {run.pid} on {run.host})" if run.state == "running" else ""
    said = {"killed": "killed before its end"}.get(run.state, run.state)
    lines = [
        f"{name} of {started:%Y-%m-%d %H:%M:%S}: {said}{where}",
        f"  {run.done} of {run.videos} videos done, {run.failed} of them failed",
    ]
    for video in run.running:
        expected = f" of {video.frames_expected}" if video.frames_expected else ""
        lines.append(f"  {video.id}: {video.frames_done}{expected} frames in {video.seconds:.0f} s")
    if run.seconds_left is not None:
        lines.append(f"  about {timedelta(seconds=round(run.seconds_left))} to go")
    lines += [
        f"  {failure.id}: failed ({failure.kind}): {failure.message}"
        for failure in run.failures[:_MOST_FAILURES]
    ]
    if len(run.failures) > _MOST_FAILURES:
        lines.append(f"  and {len(run.failures) - _MOST_FAILURES} more failed")
    if run.state in ("interrupted", "killed"):
        lines.append("  The command that started it goes on where it was stopped.")
    return lines
