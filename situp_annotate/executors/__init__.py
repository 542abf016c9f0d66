"""Where the work on a video runs: each executor is a ``concurrent.futures.Executor``.

A call may say how far it is by `report_frames`, wherever it runs.
"""

from situp_annotate.executors.executor import VideoExecutor
from situp_annotate.executors.isolation import CallLimits
from situp_annotate.executors.process import ProcessExecutor
from situp_annotate.executors.serial import SerialExecutor
from situp_annotate.executors.serving import is_isolated, report_frames
from situp_annotate.executors.socket_folder import remove_abandoned_folders

__all__ = [
    "CallLimits",
    "ProcessExecutor",
    "SerialExecutor",
    "VideoExecutor",
    "is_isolated",
    "remove_abandoned_folders",
    "report_frames",
]
