"""Trackers to choose from: what they are made of, and what they are called."""

from situp_annotate.trackers.opencv import OpenCvTracker, make_mil
from situp_annotate.trackers.presets import DEFAULT_PRESET, PRESETS, Preset
from situp_annotate.trackers.registry import (
    ENTRY_POINTS,
    default_tracker,
    find_tracker,
    folder_name,
    make_tracker,
    model_files,
    tracker_names,
)

__all__ = [
    "DEFAULT_PRESET",
    "ENTRY_POINTS",
    "PRESETS",
    "OpenCvTracker",
    "Preset",
    "default_tracker",
    "find_tracker",
    "folder_name",
    "make_mil",
    "make_tracker",
    "model_files",
    "tracker_names",
]
