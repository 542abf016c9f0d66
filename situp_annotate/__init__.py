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
    from situp_annotate.propagation import propagate
    from situp_annotate.recipe import Recipe, load_recipe
    from situp_annotate.tracking import SitupTracker, TrackerParams
    from situp_annotate.types import BoundingBox, Frame, Keyframe, Track, TrackPoint, VideoJob
    from situp_annotate.video import open_video

__version__ = "0.1.0"

_HOMES = {
    "BoundingBox": "types",
    "Frame": "types",
    "Keyframe": "types",
    "Recipe": "recipe",
    "SitupTracker": "tracking",
    "Track": "types",
    "TrackPoint": "types",
    "TrackerParams": "tracking",
    "VideoJob": "types",
    "annotate_batch": "batch",
    "annotate_video": "pipeline",
    "load_manifest": "formats.manifest",
    "load_recipe": "recipe",
    "open_video": "video",
    "propagate": "propagation",
}

__all__ = [
    "BoundingBox",
    "Frame",
    "Keyframe",
    "Recipe",
    "SitupTracker",
    "Track",
    "TrackPoint",
    "TrackerParams",
    "VideoJob",
    "annotate_batch",
    "annotate_video",
    "load_manifest",
    "load_recipe",
    "open_video",
    "propagate",
]


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
