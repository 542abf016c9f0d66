"""Correlation-filter tracking: arrays in, boxes out. No files, no processes, no OpenCV."""

from situp_annotate.tracking.params import TrackerParams
from situp_annotate.tracking.tracker import Estimate, SitupTracker, Tracker

__all__ = ["Estimate", "SitupTracker", "Tracker", "TrackerParams"]
