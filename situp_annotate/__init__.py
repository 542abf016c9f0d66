"""situp-annotate: propagate a few hand-drawn boxes through videos.

>>> from situp_annotate import SitupTracker, annotate_batch, load_manifest, propagate

Importing the package is quick: each name loads its module when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from situp_annotate.batch import annotate_batch
    from situp_annotate.formats.manifest import load_manifest
    from situp_annotate.pipeline import annotate_video
    from situp_annotate.propagation import (
        FramesInMemory,
        Labels,
        PropagationOptions,
        Suggestion,
        TrackLabels,
        propagate,
        suggest,
    )
    from situp_annotate.recipe import Recipe, load_recipe
    from situp_annotate.tracking import SitupTracker, TrackerParams
    from situp_annotate.types import (
        BoundingBox,
        Extend,
        Frame,
        Keyframe,
        Method,
        Provenance,
        State,
        Track,
        TrackPoint,
        VideoJob,
    )
    from situp_annotate.video import VideoFootage, open_video

__version__ = "0.1.0"

_HOMES = {
    "BoundingBox": "types",
    "Extend": "types",
    "Frame": "types",
    "FramesInMemory": "propagation",
    "Keyframe": "types",
    "Labels": "propagation",
    "Method": "types",
    "PropagationOptions": "propagation",
    "Provenance": "types",
    "Recipe": "recipe",
    "SitupTracker": "tracking",
    "State": "types",
    "Suggestion": "propagation",
    "Track": "types",
    "TrackLabels": "propagation",
    "TrackPoint": "types",
    "TrackerParams": "tracking",
    "VideoFootage": "video",
    "VideoJob": "types",
    "annotate_batch": "batch",
    "annotate_video": "pipeline",
    "load_manifest": "formats.manifest",
    "load_recipe": "recipe",
    "open_video": "video",
    "propagate": "propagation",
    "suggest": "propagation",
}

__all__ = [
    "BoundingBox",
    "Extend",
    "Frame",
    "FramesInMemory",
    "Keyframe",
    "Labels",
    "Method",
    "PropagationOptions",
    "Provenance",
    "Recipe",
    "SitupTracker",
    "State",
    "Suggestion",
    "Track",
    "TrackLabels",
    "TrackPoint",
    "TrackerParams",
    "VideoFootage",
    "VideoJob",
    "annotate_batch",
    "annotate_video",
    "load_manifest",
    "load_recipe",
    "open_video",
    "propagate",
    "suggest",
]


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
