"""Imported once, where worker processes are forked from, so that none of them starts cold."""

import gc

import cv2

from situp_annotate.batch import worker
from situp_annotate.compiling import load_kernels
from situp_annotate.report import load_templates

__all__ = ["worker"]

cv2.setNumThreads(1)  # and no threads, which a fork would not take along
load_kernels()
load_templates()
gc.freeze()  # collecting garbage would copy every page that processes share
