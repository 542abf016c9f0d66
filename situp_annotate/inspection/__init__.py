"""Say what a file is, and whether anything about it will bite: videos, labels, logs, recipes."""

from situp_annotate.inspection.inspecting import inspect_path
from situp_annotate.inspection.report import FileReport, Grade, Remark

__all__ = ["FileReport", "Grade", "Remark", "inspect_path"]
