"""Tables of an evaluation, in Markdown and in LaTeX.

The best figures of a column, or of a target, are bold. What is not over all targets that it should
be over, for want of boxes, stands in brackets and is not compared.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from situp_annotate.evaluation.benchmark import attribute_groups
from situp_annotate.evaluation.evaluation_report import Evaluation, TrackerResult
from situp_annotate.evaluation.scores import Scores

__all__ = ["PROTOCOL_TITLES", "Table", "evaluation_tables", "latex", "markdown", "overall_table"]

PROTOCOL_TITLES: Mapping[str, str] = {
    "ope": "One-pass evaluation (OPE)",
    "tre": "Temporal robustness evaluation (TRE)",
    "sre": "Spatial robustness evaluation (SRE)",
}

_DETAILED: Mapping[str, Callable[[Scores], float]] = {
    "AUC": lambda scores: scores.auc,
    "Precision": lambda scores: scores.precision,
}

_FIGURES = {**_DETAILED, "Norm. precision": lambda scores: scores.normalized_precision}


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of text.

    Attributes
    ----------
    title : str
        What the figures are.
    header : tuple of str
        Of the columns; the first is that of the rows' names.
    rows : tuple of tuple of str
        Cells.
    bold : frozenset of tuple of int
        Row and column, from 0, of the best figures.
    """

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    bold: frozenset[tuple[int, int]] = frozenset()


class _Cell(NamedTuple):
    """A figure, or none; `whole` if it is over all targets that it is to be over."""

    value: float | None
    whole: bool = True
    decimals: int = 3

    def __str__(self) -> str:
        if self.value is None:
            return "–"
        text = f"{self.value:.{self.decimals}f}"
        return text if self.whole else f"({text})"


def overall_table(evaluation: Evaluation, protocol: str) -> Table:
    """One row a tracker: all figures, over all targets that it has boxes of."""
    trackers, names = _ranked(evaluation, protocol), evaluation.names
    rows = [
        [
            *(_cell(tracker, protocol, names, figure) for figure in _FIGURES.values()),
            _Cell(tracker.speed, decimals=1),
        ]
        for tracker in trackers
    ]
    counts = [_count(tracker, protocol, names) for tracker in trackers]
    cells = [
        (tracker.name, *map(str, row), count)
        for tracker, row, count in zip(trackers, rows, counts, strict=True)
    ]
    title = f"{PROTOCOL_TITLES[protocol]}, mean over all targets"
    header = ("tracker", *_FIGURES, "frames/s", "targets")
    return Table(title, header, tuple(cells), _best_of_columns(rows))


def evaluation_tables(evaluation: Evaluation) -> list[Table]:
    """All tables, protocol after protocol: overall, by set, by attribute, by target."""
    tables = []
    attributes = attribute_groups(evaluation.targets)
    for protocol in evaluation.protocols:
        tables.append(overall_table(evaluation, protocol))
        sets = evaluation.sets(protocol)
        if len(sets) > 1:
            tables += _by_group(evaluation, protocol, "set", sets)
        if attributes:
            tables += _by_group(evaluation, protocol, "attribute", attributes)
        tables += _by_target(evaluation, protocol)
    return tables


def _by_group(
    evaluation: Evaluation, protocol: str, kind: str, groups: Mapping[str, Sequence[str]]
) -> Iterator[Table]:
    """One row a tracker, one column a group."""
    trackers = _ranked(evaluation, protocol)
    for name, figure in _DETAILED.items():
        rows = [
            [_cell(tracker, protocol, names, figure) for names in groups.values()]
            for tracker in trackers
        ]
        cells = [(t.name, *map(str, row)) for t, row in zip(trackers, rows, strict=True)]
        header = ("tracker", *(f"{group} ({len(names)})" for group, names in groups.items()))
        title = f"{name} by {kind}, {protocol.upper()}"
        yield Table(title, header, tuple(cells), _best_of_columns(rows))


def _by_target(evaluation: Evaluation, protocol: str) -> Iterator[Table]:
    """One row a target, one column a tracker."""
    trackers = _ranked(evaluation, protocol)
    for name, figure in _DETAILED.items():
        rows = [
            [_cell(tracker, protocol, [target], figure) for tracker in trackers]
            for target in evaluation.names
        ]
        cells = [(n, *map(str, row)) for n, row in zip(evaluation.names, rows, strict=True)]
        bold = {(row, place + 1) for row, each in enumerate(rows) for place in _best(each)}
        header = ("target", *(tracker.name for tracker in trackers))
        title = f"{name} by target, {protocol.upper()}"
        yield Table(title, header, tuple(cells), frozenset(bold))


def _ranked(evaluation: Evaluation, protocol: str) -> list[TrackerResult]:
    """The best AUC first, over the targets that all have."""
    names = evaluation.common(protocol) or evaluation.names

    def auc(tracker: TrackerResult) -> float:
        scores = tracker.mean(protocol, names)
        return 0.0 if scores is None else scores.auc

    return sorted(evaluation.of_protocol(protocol), key=auc, reverse=True)


def _cell(
    tracker: TrackerResult, protocol: str, names: Sequence[str], figure: Callable[[Scores], float]
) -> _Cell:
    scores = tracker.mean(protocol, names)
    whole = all(name in tracker.scores[protocol] for name in names)
    return _Cell(None if scores is None else figure(scores), whole)


def _count(tracker: TrackerResult, protocol: str, names: Sequence[str]) -> str:
    present = len(tracker.scores[protocol])
    return str(present) if present == len(names) else f"{present} of {len(names)}"


def _best(cells: Sequence[_Cell]) -> set[int]:
    """Places of the highest figures, as they are shown; none where there is nothing to choose."""
    shown = {
        place: round(cell.value, cell.decimals)
        for place, cell in enumerate(cells)
        if cell.value is not None and cell.whole
    }
    return {p for p, value in shown.items() if len(shown) > 1 and value == max(shown.values())}


def _best_of_columns(rows: Sequence[Sequence[_Cell]]) -> frozenset[tuple[int, int]]:
    """Row and column of the best, after a column of names."""
    columns = enumerate(zip(*rows, strict=True), start=1)
    return frozenset((row, number) for number, column in columns for row in _best(column))


def markdown(tables: Sequence[Table], notes: Sequence[str] = ()) -> str:
    """All tables as a Markdown document."""
    lines = ["# Evaluation", *(line for note in notes for line in ("", note))]
    for table in tables:
        header = [_escaped(cell) for cell in table.header]
        lines += ["", f"## {table.title}", "", _line(header)]
        lines.append(_line(["---", *["---:"] * (len(header) - 1)]))
        for row, cells in enumerate(table.rows):
            lines.append(_line([_bold(table, row, c, _escaped(x)) for c, x in enumerate(cells)]))
    return "\n".join(lines) + "\n"


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _bold(table: Table, row: int, column: int, text: str, mark: str = "**{}**") -> str:
    return mark.format(text) if (row, column) in table.bold else text


def _escaped(text: str) -> str:
    return "".join(f"\\{each}" if each in "\\|*_`<" else each for each in text)


_LATEX = {each: f"\\{each}" for each in "&%$#_{}"}
_LATEX |= {"~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\\": r"\textbackslash{}"}
_LATEX |= {"–": "--", "<": r"\textless{}", ">": r"\textgreater{}"}


def latex(tables: Sequence[Table]) -> str:
    r"""All tables as LaTeX, each a ``table`` that needs no package."""
    blocks = []
    for table in tables:
        lines = [_latex_line([_in_latex(cell) for cell in table.header]), r"\hline"]
        for row, cells in enumerate(table.rows):
            texts = [_in_latex(cell) for cell in cells]
            bold = [_bold(table, row, c, x, r"\textbf{{{}}}") for c, x in enumerate(texts)]
            lines.append(_latex_line(bold))
        columns = "l" + "r" * (len(table.header) - 1)
        blocks.append(
            "\n".join(
                [
                    r"\begin{table}",
                    rf"\caption{{{_in_latex(table.title)}}}",
                    r"\centering",
                    rf"\begin{{tabular}}{{{columns}}}",
                    *lines,
                    r"\end{tabular}",
                    r"\end{table}",
                ]
            )
        )
    return "\n\n".join(blocks) + "\n"


def _latex_line(cells: Sequence[str]) -> str:
    return " & ".join(cells) + r" \\"


def _in_latex(text: str) -> str:
    return "".join(_LATEX.get(each, each) for each in text)
