"""The command line: ``situp-annotate``. One command a file; nothing heavy is imported here."""

import click

from situp_annotate.cli._group import SitupGroup
from situp_annotate.cli.check import check
from situp_annotate.cli.contact_sheet import contact_sheet
from situp_annotate.cli.effort import effort
from situp_annotate.cli.evaluate import evaluate
from situp_annotate.cli.excerpt import excerpt
from situp_annotate.cli.export import export
from situp_annotate.cli.import_ import import_
from situp_annotate.cli.init import init
from situp_annotate.cli.inspect import inspect
from situp_annotate.cli.merge import merge
from situp_annotate.cli.overlay import overlay
from situp_annotate.cli.recover import recover
from situp_annotate.cli.run import run
from situp_annotate.cli.schema import schema
from situp_annotate.cli.score import score
from situp_annotate.cli.status import status
from situp_annotate.cli.thin import thin

__all__ = ["cli", "main"]


@click.group(cls=SitupGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="situp-annotate")
def cli() -> None:
    """Propagate a few hand-drawn boxes through folders of videos.

    \b
    From a folder of videos to labels:
      situp-annotate init clips                 write clips/manifest.json
      (type a box or two of each object into it)
      situp-annotate check clips/manifest.json
      situp-annotate run clips/manifest.json --output out
      (look at out/report.html)

    \b
    Exit codes:
      0    all is well
      1    at least one video failed or has a problem
      2    wrong use of the command line
      3    the manifest is not valid
      4    the recipe or a --set value is not valid
      5    the output cannot be written or is already there
      130  interrupted
    """


# In the order of work, which is the order of the help.
for _command in (
    *(init, import_, check, inspect, run, status, merge),
    *(overlay, contact_sheet, excerpt),
    *(export, thin, recover, effort, evaluate, score, schema),
):
    cli.add_command(_command)


def main() -> None:
    """Run the command line and exit with its code."""
    cli(prog_name="situp-annotate")
