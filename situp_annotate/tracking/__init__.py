"""Correlation-filter tracking: arrays in, boxes out. No files, no processes, no OpenCV."""

from situp_annotate.tracking.estimate import Estimate
from situp_annotate.tracking.params import TrackerParams
from situp_annotate.tracking.tracker import SitupTracker, Tracker

__all__ = ["Estimate", "SitupTracker", "Tracker", "TrackerParams"]
