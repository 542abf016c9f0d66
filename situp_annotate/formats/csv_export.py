"""Everything that is known of every label of all videos, in one table.

``labels.csv`` is what a run writes for each video (`labels_csv`), with a first column ``video``;
``pandas.read_csv`` takes it as it is. It has no rows of objects that are outside.
"""

import csv
from collections.abc import Iterable
from pathlib import Path

from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.labelled import LabelledVideo
from situp_annotate.formats.labels_csv import LABELS_HEADER, label_cells, time_cell

__all__ = ["write_csv"]

_FILE = "labels.csv"


def write_csv(videos: Iterable[LabelledVideo], folder: Path, options: ExportOptions) -> None:
    """Write ``labels.csv``.

    Parameters
    ----------
    videos : iterable of LabelledVideo
        Taken one at a time.
    folder : Path
        Is there and empty.
    options : ExportOptions
        Which labels.
    """
    with (folder / _FILE).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("video", *LABELS_HEADER))
        for video in videos:
            for frame, labelled, point in video.in_states(options.states):
                time, track = time_cell(video.times_ns[frame]), labelled.track
                writer.writerow((video.id, frame, time, track.id, track.label, *label_cells(point)))
