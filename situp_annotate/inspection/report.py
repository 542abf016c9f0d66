"""What an inspection says of a file: facts, and remarks by how much they matter."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

__all__ = ["FileReport", "Grade", "Remark", "count", "problem_report"]


class Grade(StrEnum):
    """How much a remark matters; in order, the worst last."""

    FINE = "fine"
    NOTE = "note"
    WARNING = "warning"
    PROBLEM = "problem"


@dataclass(frozen=True, slots=True)
class Remark:
    """One thing that was noticed about a file.

    Attributes
    ----------
    grade : Grade
        ``NOTE``: good to know. ``WARNING``: labels may end up in the wrong place, or some may be
        lost. ``PROBLEM``: the file cannot be used as it is.
    kind : str
        A short stable word for machines, such as ``"vfr"``.
    message : str
        What it is, what it means for labels, and what to do, in finished sentences.
    """

    grade: Grade
    kind: str
    message: str


@dataclass(frozen=True, slots=True)
class FileReport:
    """What a file is, and what about it may bite.

    Attributes
    ----------
    path : Path
        The file or folder.
    kind : str
        A short stable word for machines, such as ``"video"`` or ``"mot"``.
    title : str
        What it is, in a few words for people.
    facts : tuple of pairs of str
        Names and values, in words for people.
    remarks : tuple of Remark
        The worst first.
    """

    path: Path
    kind: str
    title: str
    facts: tuple[tuple[str, str], ...] = ()
    remarks: tuple[Remark, ...] = ()

    def __post_init__(self) -> None:
        ranks = {grade: rank for rank, grade in enumerate(reversed(Grade))}
        worst_first = sorted(self.remarks, key=lambda remark: ranks[remark.grade])
        object.__setattr__(self, "remarks", tuple(worst_first))

    @property
    def grade(self) -> Grade:
        """The worst grade of all remarks; ``FINE`` without any."""
        return self.remarks[0].grade if self.remarks else Grade.FINE

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON data."""
        return {
            "path": str(self.path),
            "kind": self.kind,
            "title": self.title,
            "grade": self.grade.value,
            "facts": dict(self.facts),
            "remarks": [
                {"grade": remark.grade.value, "kind": remark.kind, "message": remark.message}
                for remark in self.remarks
            ],
        }


def problem_report(
    path: Path,
    kind: str,
    title: str,
    message: str,
    facts: Sequence[tuple[str, str]] = (),
    *,
    remark_kind: str = "unusable",
) -> FileReport:
    """Report a file of which nothing can be said but what is wrong with it."""
    return FileReport(
        path, kind, title, tuple(facts), (Remark(Grade.PROBLEM, remark_kind, message),)
    )


def count(number: int, noun: str, plural: str | None = None) -> str:
    """Return a number with its noun: ``1 frame``, ``12 000 frames``."""
    shown = f"{number:,}".replace(",", " ")
    return f"{shown} {noun}" if number == 1 else f"{shown} {plural or noun + 's'}"
