"""Every format that boxes can be imported from: one place that knows them by name."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from situp_annotate.formats.seeds import ImportHints, Seeds

__all__ = ["IMPORTERS", "Importer"]


@dataclass(frozen=True, slots=True)
class Importer:
    """One format to import from.

    Attributes
    ----------
    title : str
        What it is, for people.
    recognizes : callable
        Whether a file, of which the beginning is given, looks like this format.
    read : callable
        Reads a file.
    """

    title: str
    recognizes: Callable[[Path, bytes], bool]
    read: Callable[[Path, ImportHints], list[Seeds]]


IMPORTERS: dict[str, Importer] = {}
"""By name, in the order in which they are asked whether they recognize a file."""
