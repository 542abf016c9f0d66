"""How a viewer is to show the log: the picture with the boxes over it."""

import json

__all__ = ["layout_json"]

_PANEL = "Image!situp"


def layout_json(picture_topic: str, annotations_topic: str) -> str:
    """Describe a layout of one panel, to be imported into Lichtblick or Foxglove.

    Notes
    -----
    The panel is not to synchronise: it would then wait for annotations of each picture's time,
    hold pictures back that have no boxes, and not decode what later pictures build on.
    """
    panel = {
        "imageMode": {
            "imageTopic": picture_topic,
            "annotations": {annotations_topic: {"visible": True}},
            "synchronize": False,
        }
    }
    layout = {
        "configById": {_PANEL: panel},
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": _PANEL,
    }
    return json.dumps(layout, indent=2) + "\n"
