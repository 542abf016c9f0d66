"""The table that ends a command, and what is in that of a run."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from situp_annotate.batch import BatchReport, Outcome

__all__ = ["summary_lines", "table_lines"]

_HEADER = ("video", "status", "frames", "frames/s", "tracks", "boxes", "confidence", "notes")
_LEFT_ALIGNED = 2


def _row(outcome: "Outcome") -> tuple[str, ...]:
    from situp_annotate.outcomes import VideoFailure

    if isinstance(outcome, VideoFailure):
        return (outcome.id, f"failed: {outcome.kind}", *["–"] * 5, "1")
    tracked = sum(track.tracked_boxes for track in outcome.tracks)
    sums = sum((track.mean_confidence or 0) * track.tracked_boxes for track in outcome.tracks)
    return (
        outcome.id,
        "ok",
        str(outcome.frames),
        f"{outcome.frames / outcome.seconds['total']:.1f}",
        str(len(outcome.tracks)),
        str(tracked + sum(track.human_boxes for track in outcome.tracks)),
        f"{sums / tracked:.2f}" if tracked else "–",
        str(len(_notes(outcome)) or "–"),
    )


def _notes(outcome: "Outcome") -> list[str]:
    from situp_annotate.outcomes import VideoFailure

    if isinstance(outcome, VideoFailure):
        return [outcome.message]
    remarks = [finding.message for finding in outcome.findings]
    return remarks + [skip.reason for skip in outcome.skipped]


def table_lines(rows: Sequence[Sequence[str]]) -> list[str]:
    """Lay out rows of cells, the header first: two columns of words, then columns of numbers."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            cell.ljust(width) if place < _LEFT_ALIGNED else cell.rjust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def summary_lines(report: "BatchReport", output: Path) -> list[str]:
    """Lay a batch out for people: a table, what to know of each video, and one line in the end."""
    lines = table_lines([_HEADER, *map(_row, report.outcomes)])
    for outcome in report.outcomes:
        lines += [f"  {outcome.id}: {note}" for note in _notes(outcome)]
    good = len(report.outcomes) - len(report.failures)
    lines.append(
        f"{good} of {len(report.outcomes)} videos annotated in {report.elapsed_s:.1f} s; "
        f"results are in {output}."
    )
    return lines
