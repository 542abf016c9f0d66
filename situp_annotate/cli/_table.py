"""The table that ends a command, and what is in that of a run."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from situp_annotate.batch import BatchReport, Outcome

__all__ = ["summary_lines", "table_lines"]

_HEADER = (
    *("video", "status", "frames", "frames/s", "tracks"),
    *("boxes", "lost", "confidence", "review", "notes"),
)
_LEFT_ALIGNED = 2


def _row(outcome: "Outcome") -> tuple[str, ...]:
    from situp_annotate.outcomes import VideoFailure

    if isinstance(outcome, VideoFailure):
        return (outcome.id, f"failed: {outcome.kind}", *["–"] * 7, "1")
    tracks = outcome.tracks
    guessed = sum(track.propagated_boxes for track in tracks)
    sums = sum((track.mean_confidence or 0) * track.propagated_boxes for track in tracks)
    lost = sum(track.lost_frames for track in tracks)
    return (
        outcome.id,
        "ok",
        str(outcome.frames),
        f"{outcome.frames / outcome.seconds['total']:.1f}",
        str(len(tracks)),
        str(guessed + sum(track.human_boxes for track in tracks) - lost),
        str(lost),
        f"{sums / guessed:.2f}" if guessed else "–",
        str(sum(len(track.review) for track in tracks)),
        str(len(_notes(outcome)) or "–"),
    )


def _notes(outcome: "Outcome") -> list[str]:
    from situp_annotate.outcomes import VideoFailure

    if isinstance(outcome, VideoFailure):
        return [outcome.message]
    remarks = [finding.message for finding in outcome.findings]
    return remarks + [skip.reason for skip in outcome.skipped]


def _first_to_review(report: "BatchReport") -> list[str]:
    """One line that names the frame where a box helps most; none if nothing is left to gain."""
    from situp_annotate.outcomes import VideoReport

    found = [
        (suggestion, outcome.id)
        for outcome in report.outcomes
        if isinstance(outcome, VideoReport)
        for track in outcome.tracks
        for suggestion in track.review
    ]
    if not found:
        return []
    best, video_id = max(found, key=lambda pair: pair[0].gain)
    place = f"{video_id}, track {best.track_id}, frame {best.frame}"
    return [f"Review first: {place} ({best.reason}, +{best.gain:.0f} frames)"]


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


def _where(report: "BatchReport", output: Path) -> str:
    from situp_annotate.results import REPORT_FILE

    if report.recipe.outputs.report:
        return f"look at {output / REPORT_FILE}"
    return f"results are in {output}"


def summary_lines(report: "BatchReport", output: Path) -> list[str]:
    """Lay a batch out for people: a table, what to know of each video, and one line in the end."""
    lines = table_lines([_HEADER, *map(_row, report.outcomes)])
    for outcome in report.outcomes:
        lines += [f"  {outcome.id}: {note}" for note in _notes(outcome)]
    lines += _first_to_review(report)
    good = len(report.outcomes) - len(report.failures)
    lines.append(
        f"{good} of {len(report.outcomes)} videos annotated in {report.elapsed_s:.1f} s; "
        f"{_where(report, output)}."
    )
    return lines
