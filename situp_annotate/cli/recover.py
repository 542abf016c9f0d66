"""``situp-annotate recover``: what is whole of an MCAP file that was not finished."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from situp_annotate.formats.mcap.recovery import Recovery

__all__ = ["recover"]

_HEADER = ("topic", "messages")


def _default_output(file: Path) -> Path:
    """Return ``annotations.recovered.mcap`` for ``annotations.mcap.partial``, beside it."""
    stem = file.name.removesuffix(".partial").removesuffix(".mcap")
    return file.with_name(f"{stem}.recovered.mcap")


def _span(recovery: "Recovery") -> str:
    if recovery.first_ns is None or recovery.last_ns is None:
        return "no messages"
    first_s, last_s = recovery.first_ns / 1e9, recovery.last_ns / 1e9
    return f"{recovery.messages.total()} messages from {first_s:.3f} s to {last_s:.3f} s"


def _state(recovery: "Recovery") -> str:
    """Say what was wrong with the file."""
    wrong = [] if recovery.finished else ["it was not finished or is cut off"]
    if recovery.damaged:
        wrong.append(f"{recovery.damaged} of its records are damaged and left out")
    return "; ".join(wrong) or "nothing was wrong with it"


@click.command(short_help="Rescue what is whole of an unfinished or damaged MCAP file.")
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option(
    "--output",
    "-o",
    type=click.Path(dir_okay=False, path_type=Path),
    help="The file to write; NAME.recovered.mcap beside FILE if not given.",
)
@click.option("--overwrite", is_flag=True, help="Replace the file to write if it is there.")
def recover(file: Path, output: Path | None, overwrite: bool) -> None:
    """Write what is whole of an MCAP file to a new, complete one, with an index.

    FILE is any MCAP: unfinished, cut off or damaged. A run that was killed leaves one in a hidden
    folder, which the next run removes: rescue it first.

    \b
      situp-annotate recover out/.clip.partial/annotations.mcap.partial -o rescued.mcap

    Exit codes: 0 when something is rescued, 1 when FILE is no MCAP or nothing of it is whole, 5
    when the new file is already there or cannot be written.
    """
    from situp_annotate.cli._table import table_lines
    from situp_annotate.formats.mcap.recovery import recover_mcap

    output = output or _default_output(file)
    recovery = recover_mcap(file, output, overwrite=overwrite)
    rows = [(topic, str(count)) for topic, count in sorted(recovery.messages.items())]
    for line in table_lines([_HEADER, *rows]) if rows else []:
        click.echo(line)
    others = f"{recovery.attachments} attachments, {recovery.metadata} metadata records"
    click.echo(f"Rescued of {file}: {_span(recovery)}, {others} ({_state(recovery)}).")
    click.echo(f"They are in {output}.")
