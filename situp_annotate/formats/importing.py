"""Every format that boxes can be imported from: one place that knows them by name."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from situp_annotate.formats.coco.importing import read_coco, recognizes_coco
from situp_annotate.formats.cvat.importing import read_cvat, recognizes_cvat
from situp_annotate.formats.label_studio.importing import read_label_studio, recognizes_label_studio
from situp_annotate.formats.mot.importing import read_mot_seeds, recognizes_mot
from situp_annotate.formats.otb import read_otb, recognizes_otb
from situp_annotate.formats.seeds import ImportHints, Seeds

__all__ = ["IMPORTERS", "Importer"]


@dataclass(frozen=True, slots=True)
class Importer:
    """One format to import from.

    Attributes
    ----------
    recognizes : callable
        Whether a file, of which the beginning is given, looks like this format.
    read : callable
        Reads a file.
    """

    recognizes: Callable[[Path, bytes], bool]
    read: Callable[[Path, ImportHints], list[Seeds]]


IMPORTERS: dict[str, Importer] = {
    "cvat": Importer(recognizes_cvat, read_cvat),
    "mot": Importer(recognizes_mot, read_mot_seeds),
    "label-studio": Importer(recognizes_label_studio, read_label_studio),
    "coco": Importer(recognizes_coco, read_coco),
    "otb": Importer(recognizes_otb, read_otb),
}
"""By name, in the order in which they are asked whether they recognize a file."""
