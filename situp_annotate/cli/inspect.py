"""``situp-annotate inspect``: what files are, and whether anything about them will bite."""

import json
import shutil
import sys
import textwrap
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from situp_annotate.errors import EXIT_FAILED

if TYPE_CHECKING:
    from situp_annotate.inspection import FileReport

__all__ = ["inspect"]

_MAX_WIDTH = 100


def _sayable(text: str) -> str:
    """Text that fits into UTF-8, on one line: names of files, and what stands in them."""
    clean = text.encode("utf-8", "backslashreplace").decode()
    return "".join(char if char.isprintable() else ascii(char)[1:-1] for char in clean)


def _wrapped(name: str, text: str, indent: int, width: int) -> str:
    return textwrap.fill(
        _sayable(text),
        width,
        initial_indent=f"  {_sayable(name)}".ljust(indent),
        subsequent_indent=" " * indent,
        break_long_words=False,
        break_on_hyphens=False,
    )


def _lines(report: "FileReport", width: int) -> Iterator[str]:
    yield f"{_sayable(str(report.path))}: {_sayable(report.title)}: {report.grade.value}"
    longest = max((len(_sayable(name)) for name, _ in report.facts), default=0)
    for name, value in report.facts:
        yield _wrapped(name, value, min(longest, 30) + 4, width)
    for remark in report.remarks:
        yield _wrapped(f"{remark.grade.value}:", remark.message, 11, width)


def _inspect_all(paths: Sequence[Path], *, quick: bool) -> "Iterator[FileReport]":
    """Inspect the files, with a progress bar for each when stderr is a terminal."""
    from tqdm import tqdm

    from situp_annotate.inspection import inspect_path

    for path in paths:
        with tqdm(
            desc=_sayable(path.name),
            unit="",
            unit_scale=True,
            leave=False,
            disable=not sys.stderr.isatty(),
        ) as bar:

            def show(done: int, total: int | None, bar: tqdm = bar) -> None:
                bar.total = total
                bar.update(done - bar.n)

            report = inspect_path(path, quick=quick, on_progress=show)
        yield report


def _verdict(reports: "Sequence[FileReport]") -> str:
    from situp_annotate.inspection import Grade

    grades = Counter(report.grade for report in reports)
    parts = [f"{grades[grade]} {grade.value}" for grade in Grade if grades[grade]]
    return f"{len(reports)} files: {', '.join(parts)}."


@click.command(short_help="Say what files are, and whether anything about them will bite.")
@click.argument(
    "files", nargs=-1, required=True, metavar="FILE...", type=click.Path(path_type=Path)
)
@click.option(
    "--quick",
    is_flag=True,
    help="Look at headers, indexes and packets only; decode nothing but the first picture.",
)
@click.option("--json", "as_json", is_flag=True, help="Print a JSON list instead, for machines.")
def inspect(files: tuple[Path, ...], quick: bool, as_json: bool) -> None:
    """Say of each FILE what it is, and whether anything about it will bite.

    FILE may be a video, a folder of pictures, a manifest or recipe, the output of a run, an MCAP,
    or labels of another tool: MOT, CVAT, Label Studio, COCO, OTB. Videos are decoded to their
    end, unless --quick is given.

    \b
      situp-annotate inspect street.mp4 annotations.xml
      situp-annotate inspect --quick clips/*.mp4

    A note is good to know. A warning may put labels into the wrong place, or lose some. With a
    problem, the file cannot be used as it is.

    Exit codes: 0 when no file has a problem, 1 when one has.
    """
    from situp_annotate.inspection import Grade

    width = min(shutil.get_terminal_size((_MAX_WIDTH, 24)).columns, _MAX_WIDTH)
    reports: list[FileReport] = []
    for report in _inspect_all(files, quick=quick):
        if not as_json:
            gap = "\n" if reports else ""
            click.echo(gap + "\n".join(_lines(report, width)))
        reports.append(report)
    if as_json:
        # Escaped, as a file's name may be no text at all.
        click.echo(json.dumps([report.as_dict() for report in reports], indent=2))
    elif len(reports) > 1:
        click.echo(f"\n{_verdict(reports)}")
    if any(report.grade is Grade.PROBLEM for report in reports):
        raise click.exceptions.Exit(EXIT_FAILED)
