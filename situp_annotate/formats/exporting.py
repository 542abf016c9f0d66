"""Every format that labels can be exported to: one place that knows them by name."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from situp_annotate.formats.coco.exporting import write_coco
from situp_annotate.formats.csv_export import write_csv
from situp_annotate.formats.cvat.exporting import write_cvat
from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.label_studio.exporting import write_label_studio
from situp_annotate.formats.labelled import LabelledVideo
from situp_annotate.formats.mot.exporting import write_cvat_mot, write_mot, write_mot_truth
from situp_annotate.formats.yolo import write_yolo

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


EXPORTERS: dict[str, Exporter] = {
    "cvat": Exporter("CVAT for video 1.1, with as few keyframes as can be", write_cvat),
    "cvat-mot": Exporter("archives that CVAT imports as MOT 1.1", write_cvat_mot),
    "mot": Exporter("MOTChallenge result, a row a box", write_mot),
    "mot-gt": Exporter("MOTChallenge ground truth, with classes", write_mot_truth),
    "label-studio": Exporter("Label Studio predictions, and an interface", write_label_studio),
    "coco": Exporter("COCO with videos and tracks, as TAO has it", write_coco),
    "yolo": Exporter("a training set for Ultralytics YOLO", write_yolo),
    "csv": Exporter("everything that is known of every label, a row each", write_csv),
}
"""By name."""
