"""Every format that labels can be exported to: one place that knows them by name."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeAlias

from situp_annotate.formats.coco.exporting import write_coco
from situp_annotate.formats.csv_export import write_csv
from situp_annotate.formats.cvat.exporting import write_cvat
from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.label_studio.exporting import write_label_studio
from situp_annotate.formats.labelled import LabelledVideo
from situp_annotate.formats.mot.exporting import write_cvat_mot, write_mot, write_mot_truth
from situp_annotate.formats.yolo import write_yolo

__all__ = ["EXPORTERS", "Exporter"]

Exporter: TypeAlias = Callable[[Iterable[LabelledVideo], Path, ExportOptions], None]
"""Writes videos into a folder that is there and empty."""

EXPORTERS: dict[str, Exporter] = {
    "cvat": write_cvat,
    "cvat-mot": write_cvat_mot,
    "mot": write_mot,
    "mot-gt": write_mot_truth,
    "label-studio": write_label_studio,
    "coco": write_coco,
    "yolo": write_yolo,
    "csv": write_csv,
}
"""By name."""
