"""``situp-annotate merge``: one report of a batch that was run in shards."""

from pathlib import Path

import click

__all__ = ["merge"]


@click.command(short_help="Join the reports of a batch that was run in shards.")
@click.argument("out", type=click.Path(exists=True, file_okay=False, path_type=Path))
def merge(out: Path) -> None:
    """Write batch.json and report.html of OUT, into which all shards of a batch were run.

    \b
      situp-annotate run clips/manifest.json --output /shared/out --shard 1/2   on one machine
      situp-annotate run clips/manifest.json --output /shared/out --shard 2/2   on another
      situp-annotate merge /shared/out

    Exit codes: 0 when every video is annotated, 1 when one failed, or a shard has not come to its
    end; 5 when one is still running or nothing can be written.
    """
    from situp_annotate.batch import merge_batch
    from situp_annotate.cli._table import summary_lines

    report = merge_batch(out)
    for line in summary_lines(report, out):
        click.echo(line)
    raise click.exceptions.Exit(report.exit_code)
