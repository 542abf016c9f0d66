"""``situp-annotate run``: the main job."""

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from situp_annotate.cli._events import Events, shown_events
from situp_annotate.cli._signals import stopped_by_signals
from situp_annotate.errors import EXIT_INTERRUPTED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from situp_annotate.batch import BatchReport, Shard
    from situp_annotate.executors import CallLimits, VideoExecutor
    from situp_annotate.recipe import Recipe
    from situp_annotate.types import VideoJob

__all__ = ["run"]

_MOST_PLANNED = 200


class _ShardType(click.ParamType):  # type: ignore[type-arg]
    """``I/N``: one of N equal parts."""

    name = "I/N"

    def convert(
        self,
        value: Any,  # noqa: ANN401
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> "Shard":
        from situp_annotate.batch import Shard

        number, slash, count = str(value).partition("/")
        numbers = slash and number.isdecimal() and count.isdecimal()
        if not numbers or not 1 <= int(number) <= int(count):
            self.fail(f"{value!r} is not I/N with I from 1 to N, such as 1/4.", param, ctx)
        return Shard(int(number), int(count))


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
    default="fast",
    show_default=True,
    help="Ready-made recipe (fast, accurate, situp, overlay, csv_only) or path of a TOML file.",
)
@click.option(
    "--set",
    "settings",
    metavar="SECTION.KEY=VALUE",
    multiple=True,
    help="Change one value of the recipe; may be given several times.",
)
@click.option("--fresh", is_flag=True, help="Do all videos anew, also those that are up to date.")
@click.option("--dry-run", is_flag=True, help="Only say what would be done, and why.")
@click.option(
    "--workers",
    "-w",
    type=click.IntRange(min=1),
    help="Videos to annotate at a time, one process and one core each; fewer videos use the cores "
    "to follow tracks side by side.  [default: as many as cores and free memory allow]",
)
@click.option(
    "--timeout",
    type=click.FloatRange(min=0, min_open=True),
    metavar="SECONDS",
    help="Give up a video that takes longer.  [default: never]",
)
@click.option(
    "--stall",
    type=click.FloatRange(min=0),
    metavar="SECONDS",
    default=600,
    show_default=True,
    help="Give up a video that comes to no further frame for so long; 0: never.",
)
@click.option(
    "--retries",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Try a video again so often whose process crashed, was killed, or took too long.",
)
@click.option(
    "--executor",
    type=click.Choice(["process", "serial", "dask"]),
    default="process",
    show_default=True,
    help="Where to work: in processes of this machine; 'serial', in this very process, for "
    "debugging; 'dask', on a cluster.",
)
@click.option("--scheduler", metavar="ADDRESS", help="Of the Dask cluster: tcp://host:8786.")
@click.option(
    "--shard",
    type=_ShardType(),
    help="Do only this part of the videos, such as 1/4; `merge` joins the reports.",
)
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
@click.option(
    "--log-json",
    type=click.Path(path_type=Path, dir_okay=False, allow_dash=True),
    metavar="FILE",
    help="Append every event to a file, a line of JSON each; '-' is stdout.",
)
@click.option("--verbose", "-v", is_flag=True, help="A line for every video that starts or ends.")
@click.option("--quiet", "-q", is_flag=True, help="Nothing but failures.")
def run(
    manifest: Path,
    output: Path,
    recipe: str,
    settings: tuple[str, ...],
    fresh: bool,
    dry_run: bool,
    workers: int | None,
    timeout: float | None,
    stall: float,
    retries: int,
    executor: str,
    scheduler: str | None,
    shard: "Shard | None",
    no_cache: bool,
    allow_outside: bool,
    log_json: Path | None,
    verbose: bool,
    quiet: bool,
) -> None:
    """Propagate the boxes of MANIFEST through its videos and write the results.

    Each video gets a folder in the output folder, with labels.csv, mot.csv, annotations.mcap,
    overlay.mp4, report.html and more; report.html beside them shows what became of all of them, and
    what is worth a look. A video that fails leaves no folder and does not stop the others; why it
    failed stands in logs/ID.log.

    Run it again, after a correction of MANIFEST or because it was stopped, and only what is
    missing, failed or changed is done. What the tracker said is kept in .cache in the output
    folder, and only spans of a video that have changed are tracked anew.

    \b
      situp-annotate run clips/manifest.json --output out
      situp-annotate run clips/manifest.json --recipe csv_only --workers 4
      situp-annotate run clips/manifest.json --set tracker.learning_rate=0.01 --dry-run
      situp-annotate run clips/manifest.json --timeout 3600 --retries 1 --log-json log.jsonl

    Ctrl-C stops the workers, keeps what is complete and says how to go on; a second one stops at
    once.

    Exit codes: 0 when every video is annotated, 1 when one failed, 3 for a manifest and 4 for a
    recipe that is not valid, 5 when the output cannot be written, 130 when interrupted.
    """
    from situp_annotate.cli._table import summary_lines
    from situp_annotate.executors import CallLimits
    from situp_annotate.formats.manifest import load_manifest
    from situp_annotate.recipe import load_recipe

    if (executor == "dask") != (scheduler is not None):
        raise click.UsageError("--executor dask and --scheduler ADDRESS go together.")
    if verbose and quiet:
        raise click.UsageError("--verbose and --quiet exclude each other.")
    chosen = load_recipe(recipe, settings)
    jobs = load_manifest(manifest, allow_outside=allow_outside, limits=chosen.limits).jobs
    if dry_run:
        _show_plan(jobs, output, chosen, fresh=fresh, shard=shard)
        return
    limits = CallLimits(timeout, stall or None)
    with shown_events(verbose - quiet, log_json) as events:
        report = _annotate(
            jobs,
            output,
            chosen,
            events,
            workers=workers,
            executor=_executor(executor, scheduler, output, limits),
            limits=limits,
            retries=retries,
            fresh=fresh,
            cache=not no_cache,
            shard=shard,
        )
    if not quiet:
        for line in summary_lines(report, output):
            click.echo(line)
    if report.stopped_by is not None:
        click.echo(f"Stopped early: {report.stopped_by.message} {_how_to_go_on()}", err=True)
    raise click.exceptions.Exit(report.exit_code)


def _executor(
    name: str, scheduler: str | None, output: Path, limits: "CallLimits"
) -> "Literal['process', 'serial'] | VideoExecutor":
    if scheduler is not None:
        from situp_annotate.executors.dask_executor import DaskExecutor

        return DaskExecutor(scheduler, output, limits)
    return "serial" if name == "serial" else "process"


def _annotate(
    jobs: "Sequence[VideoJob]",
    output: Path,
    recipe: "Recipe",
    events: Events,
    **options: Any,  # noqa: ANN401 - those of annotate_batch
) -> "BatchReport":
    from situp_annotate.batch import annotate_batch
    from situp_annotate.compiling import kernels_are_compiled

    if not kernels_are_compiled():
        click.echo("Compiling the tracker for this machine, once: some twenty seconds.", err=True)
    try:
        with stopped_by_signals():
            return annotate_batch(
                jobs,
                output,
                recipe,
                on_progress=events.on_progress,
                on_event=events.on_event,
                **options,
            )
    except KeyboardInterrupt:
        done = events.last.get("succeeded", 0)
        click.echo(
            f"Interrupted: {done} of {len(jobs)} videos are complete in {output}. "
            f"{_how_to_go_on()}",
            err=True,
        )
        raise click.exceptions.Exit(EXIT_INTERRUPTED) from None


def _how_to_go_on() -> str:
    """The command that was typed, without what would make it start from nothing."""
    arguments = [each for each in sys.argv[1:] if each != "--fresh"]
    return f"Go on with: {shlex.join(['situp-annotate', *arguments])}"


def _show_plan(
    jobs: "Sequence[VideoJob]",
    output: Path,
    recipe: "Recipe",
    *,
    fresh: bool,
    shard: "Shard | None",
) -> None:
    """Say which videos would be worked on, and why."""
    from situp_annotate.batch import planned_batch

    plan = planned_batch(jobs, output, recipe, fresh=fresh, shard=shard)
    to_do = [(job, reason) for job, reason in plan if reason is not None]
    for job, reason in to_do[:_MOST_PLANNED]:
        click.echo(f"{job.id}: {reason}")
    if len(to_do) > _MOST_PLANNED:
        click.echo(f"and {len(to_do) - _MOST_PLANNED} more")
    ready = len(plan) - len(to_do)
    click.echo(f"{len(to_do)} of {len(plan)} videos would be done, {ready} are up to date.")
