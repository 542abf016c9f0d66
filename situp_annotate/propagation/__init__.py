"""From a few keyframes to a box in every frame: pure, no files, no clocks, no processes."""

from situp_annotate.propagation.propagate import (
    Propagation,
    Skip,
    TrackerFactory,
    propagate,
)

__all__ = ["Propagation", "Skip", "TrackerFactory", "propagate"]
