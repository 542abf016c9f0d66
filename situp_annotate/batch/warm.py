"""Imported once, where worker processes are forked from, so that none of them starts cold."""

import cv2

from situp_annotate.batch import worker
from situp_annotate.compiling import load_kernels

__all__ = ["worker"]

cv2.setNumThreads(1)  # and no threads, which a fork would not take along
load_kernels()
