"""COCO with videos and tracks."""
