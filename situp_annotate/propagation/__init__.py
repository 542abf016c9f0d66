"""From a few keyframes to a box in every frame: pure, no files, no clocks, no processes."""

from situp_annotate.propagation.footage import Footage, FramesInMemory
from situp_annotate.propagation.labels import Labels, Skip, Stretch, TrackLabels
from situp_annotate.propagation.options import PropagationOptions
from situp_annotate.propagation.passes import Pass, TrackerFactory
from situp_annotate.propagation.propagate import propagate
from situp_annotate.propagation.review import Reason, Suggestion, suggest
from situp_annotate.propagation.spans import PassKey
from situp_annotate.propagation.walking import PassCache, Survey

__all__ = [
    "Footage",
    "FramesInMemory",
    "Labels",
    "Pass",
    "PassCache",
    "PassKey",
    "PropagationOptions",
    "Reason",
    "Skip",
    "Stretch",
    "Suggestion",
    "Survey",
    "TrackLabels",
    "TrackerFactory",
    "propagate",
    "suggest",
]
