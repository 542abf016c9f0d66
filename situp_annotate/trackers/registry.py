"""Trackers by name: ours, OpenCV's, and those that other packages bring."""

from collections.abc import Callable
from functools import cache, partial
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from urllib.parse import quote

from situp_annotate.errors import TrackingError
from situp_annotate.trackers.opencv import MODEL_FILES, make_mil, make_with_models
from situp_annotate.trackers.presets import DEFAULT_PRESET, PRESETS
from situp_annotate.trackers.variants import variant_params
from situp_annotate.tracking import SitupTracker, Tracker

__all__ = [
    "ENTRY_POINTS",
    "default_tracker",
    "find_tracker",
    "folder_name",
    "make_tracker",
    "model_files",
    "tracker_names",
]

ENTRY_POINTS = "situp_annotate.trackers"
"""Group of the entry points by which other packages add trackers: callables that make one."""

_MIL = "mil"


def folder_name(name: str) -> str:
    """A tracker's name as that of a folder."""
    return quote(name, safe=" ")


def model_files(name: str) -> list[Path]:
    """Files of the user that a tracker of this name is made of."""
    kind, _, files = name.partition(":")
    return [Path(file) for file in files.split(",")] if kind in MODEL_FILES and files else []


@cache
def _plugins() -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=ENTRY_POINTS)}


def tracker_names() -> list[str]:
    """Names of all trackers that need nothing but their name; ours first, those added last."""
    return [*PRESETS, _MIL, *sorted(_plugins())]


def find_tracker(name: str) -> Callable[[], Tracker]:
    """What makes trackers of a name.

    Parameters
    ----------
    name : str
        One of `tracker_names`; one of ours with settings, ``situp:scale_criterion=max,…``; or
        ``vit:MODEL``, ``nano:BACKBONE,NECKHEAD`` or ``dasiamrpn:MODEL,KERNEL_CLS1,KERNEL_R1`` with
        paths of files.

    Raises
    ------
    TrackingError
        If there is no such tracker, a setting is not allowed, a model file is missing, or a
        plug-in cannot be loaded.
    """
    kind = name.partition(":")[0]
    if kind in PRESETS:
        return partial(SitupTracker, variant_params(name))
    if name == _MIL:
        return make_mil
    if kind in MODEL_FILES:
        make = partial(make_with_models, kind, model_files(name))
        make()  # so that a missing file is noticed now
        return make
    if name in _plugins():
        return _load(_plugins()[name])
    needing = [f"{kind}:{','.join(wanted)}" for kind, wanted in MODEL_FILES.items()]
    raise TrackingError(
        f"{name!r} is no tracker; known are {', '.join((*tracker_names(), *needing))}."
    )


def _load(point: EntryPoint) -> Callable[[], Tracker]:
    try:
        factory = point.load()
    except Exception as error:
        raise TrackingError(
            f"The tracker {point.name!r} of {point.value} cannot be loaded: {error}."
        ) from error
    if not callable(factory):
        raise TrackingError(f"The tracker {point.name!r}: {point.value} cannot be called.")
    return factory  # type: ignore[no-any-return]


def default_tracker() -> Tracker:
    """A fresh tracker of the kind that ``run`` takes where nothing else is asked for."""
    return SitupTracker(PRESETS[DEFAULT_PRESET].params)


def make_tracker(name: str) -> Tracker:
    """A fresh tracker; parameters and errors are those of `find_tracker`."""
    return find_tracker(name)()
