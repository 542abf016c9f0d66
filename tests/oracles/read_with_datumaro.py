"""Print the boxes that datumaro finds in a file or folder, as JSON.

Run by an interpreter that has datumaro: ``python read_with_datumaro.py cvat clip.xml``. CVAT, which
uses datumaro itself, calls the formats ``cvat`` and ``mot_seq``.
"""

import json
import sys

from datumaro import Bbox, Dataset


def boxes(dataset):
    labels = [category.name for category in next(iter(dataset.categories().values()))]
    for item in dataset:
        for annotation in item.annotations:
            assert type(annotation) is Bbox, annotation
            yield {
                "item": item.id,
                "frame": item.attributes.get("frame"),
                "box": [annotation.x, annotation.y, annotation.w, annotation.h],
                "label": labels[annotation.label],
                "attributes": dict(annotation.attributes),
            }


if __name__ == "__main__":
    json.dump(list(boxes(Dataset.import_from(sys.argv[2], sys.argv[1]))), sys.stdout)
