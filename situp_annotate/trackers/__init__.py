"""Trackers by name."""

from situp_annotate.errors import SitupError
from situp_annotate.tracking import SitupTracker, Tracker

__all__ = ["make_tracker", "tracker_names"]

_MAKERS = {"situp": SitupTracker}


def tracker_names() -> list[str]:
    """Names that `make_tracker` knows."""
    return list(_MAKERS)


def make_tracker(name: str) -> Tracker:
    """Make a tracker that has no target yet.

    Raises
    ------
    SitupError
        If there is none of this name.
    """
    if name not in _MAKERS:
        known = ", ".join(tracker_names())
        raise SitupError(f"There is no tracker called {name!r}; known are {known}.")
    return _MAKERS[name]()
