"""Text files line by line, in bounded memory, and faults counted by kind."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import IO

from situp_annotate.inspection.report import Grade, Remark, count

__all__ = ["Fault", "Tally", "read_lines"]

_MAX_LINE = 10_000
"""Bytes; longer lines come in pieces, and no piece is a row of anything."""


def read_lines(file: IO[bytes]) -> Iterator[tuple[int, str]]:
    """Yield lines that are not blank, with their numbers from 1; a byte-order mark is kept."""
    number = 0
    while line := file.readline(_MAX_LINE):
        number += 1
        text = line.decode("utf-8", errors="replace").strip(" \t\r\n\0")
        if text:
            yield number, text


@dataclass(frozen=True, slots=True)
class Fault:
    """A kind of fault, and how it is told: "`headline`: 3 rows (first: line 7). `advice`".

    Attributes
    ----------
    grade : Grade
        How much it matters.
    kind : str
        A short stable word for machines.
    noun : str
        What is counted, such as ``"row"``.
    headline, advice : str
        What is wrong; what that means, and what to do.
    """

    grade: Grade
    kind: str
    noun: str
    headline: str
    advice: str


class Tally:
    """Counts faults by kind and remembers where the first of each stands."""

    def __init__(self) -> None:
        self._numbers: Counter[str] = Counter()
        self._first: dict[str, str] = {}

    def add(self, kind: str, place: str) -> None:
        """Take in one fault."""
        self._numbers[kind] += 1
        self._first.setdefault(kind, place)

    def number(self, kind: str) -> int:
        """How many of a kind there were."""
        return self._numbers[kind]

    def remarks(self, faults: Iterable[Fault]) -> Iterator[Remark]:
        """Yield a remark for each of the faults that there were any of."""
        for fault in faults:
            number = self._numbers[fault.kind]
            if number:
                first = "" if number == 1 else "first: "
                where = f"{count(number, fault.noun)} ({first}{self._first[fault.kind]})"
                message = f"{fault.headline}: {where}. {fault.advice}"
                yield Remark(fault.grade, fault.kind, message)
