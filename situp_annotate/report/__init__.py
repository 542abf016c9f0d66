"""The review report: an HTML page of the whole batch, and one of each video."""

from situp_annotate.report.index_page import FailedRow, TrackRow, VideoRow, index_html
from situp_annotate.report.rendering import load_templates
from situp_annotate.report.strips import profile
from situp_annotate.report.video_page import ReportSink

__all__ = [
    "FailedRow",
    "ReportSink",
    "TrackRow",
    "VideoRow",
    "index_html",
    "load_templates",
    "profile",
]
