"""Every format that labels can be exported to: one place that knows them by name."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.labelled import LabelledVideo

__all__ = ["EXPORTERS", "Exporter"]


@dataclass(frozen=True, slots=True)
class Exporter:
    """One format to export to.

    Attributes
    ----------
    title : str
        What it is, for people.
    write : callable
        Writes videos into a folder that is there and empty.
    """

    title: str
    write: Callable[[Iterable[LabelledVideo], Path, ExportOptions], None]


EXPORTERS: dict[str, Exporter] = {}
"""By name."""
