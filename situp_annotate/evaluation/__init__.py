"""Measure trackers the way the field does."""

from situp_annotate.evaluation.datasets import OtbSequence, OtbTarget, find_sequences
from situp_annotate.evaluation.metrics import OnePassResult, evaluate_one_pass
from situp_annotate.formats.otb import read_boxes
from situp_annotate.propagation.fusion import overlaps

__all__ = [
    "OnePassResult",
    "OtbSequence",
    "OtbTarget",
    "evaluate_one_pass",
    "find_sequences",
    "overlaps",
    "read_boxes",
]
