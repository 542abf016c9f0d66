"""Annotate many videos: one worker process each; one video's failure never costs another."""

from situp_annotate.batch.merging import merge_batch
from situp_annotate.batch.report import BatchReport, Outcome
from situp_annotate.batch.running import annotate_batch, planned_batch
from situp_annotate.batch.sizing import core_count
from situp_annotate.batch.state import Shard
from situp_annotate.batch.status import RunStatus, read_status

__all__ = [
    "BatchReport",
    "Outcome",
    "RunStatus",
    "Shard",
    "annotate_batch",
    "core_count",
    "merge_batch",
    "planned_batch",
    "read_status",
]
