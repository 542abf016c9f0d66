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
_MOST_ROWS = 60


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
        f"{outcome.frames / outcome.seconds['total']:.1f}" if outcome.seconds else "–",
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


class _Summary:
    """Gathers what is worth saying of a batch, without keeping the batch."""

    def __init__(self) -> None:
        self.rows: list[tuple[str, ...]] = []
        self.notes: list[str] = []
        self.left_out = 0
        self._best: tuple[float, str] | None = None

    def add(self, outcome: "Outcome") -> None:
        from situp_annotate.outcomes import VideoFailure

        if isinstance(outcome, VideoFailure) or len(self.rows) < _MOST_ROWS:
            self.rows.append(_row(outcome))
            self.notes += [f"  {outcome.id}: {note}" for note in _notes(outcome)]
        else:
            self.left_out += 1
        if isinstance(outcome, VideoFailure):
            return
        for track in outcome.tracks:
            for each in track.review:
                if self._best is None or each.gain > self._best[0]:
                    place = f"{outcome.id}, track {each.track_id}, frame {each.frame}"
                    line = f"Review first: {place} ({each.reason}, +{each.gain:.0f} frames)"
                    self._best = each.gain, line

    @property
    def lines(self) -> list[str]:
        """The table, what to know of each video, and the frame where a box helps most."""
        left_out = [f"and {self.left_out} more that are ok"] if self.left_out else []
        table = table_lines([_HEADER, *self.rows])
        return [*table, *left_out, *self.notes, *([self._best[1]] if self._best else [])]


def summary_lines(report: "BatchReport", output: Path) -> list[str]:
    """Lay a batch out for people: a table, what to know of each video, and one line in the end.

    Of a large batch, the table has the first videos and all that failed.
    """
    summary = _Summary()
    for outcome in report.outcomes:
        summary.add(outcome)
    counts = report.counts
    ready = f" ({report.up_to_date} were up to date)" if report.up_to_date else ""
    last = (
        f"{counts['succeeded']} of {report.jobs} videos annotated{ready} in "
        f"{report.elapsed_s:.1f} s; {_where(report, output)}."
    )
    return [*summary.lines, last]
