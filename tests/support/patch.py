"""A textured patch that slides over a plain ground, so that its box is known in every frame."""

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from situp_annotate.types import BoundingBox, Image, Keyframe, Track, VideoJob
from support.media import write_video

__all__ = ["STEP", "box_at", "keyframe_at", "moving", "patch_job", "write_patch"]

STEP = 2
"""Pixels that the patch goes to the right in each frame."""


def moving(count: int = 12, size: tuple[int, int] = (96, 160)) -> Iterator[Image]:
    """Pictures with the patch, 24 × 24 pixels."""
    random = np.random.default_rng(3)
    patch = cv2.resize(random.integers(0, 256, (6, 6, 3), dtype=np.uint8), (24, 24))
    for index in range(count):
        image = np.full((*size, 3), 110, np.uint8)
        image[40:64, 20 + STEP * index : 44 + STEP * index] = patch
        yield image


def write_patch(path: Path, count: int = 12, size: tuple[int, int] = (96, 160)) -> Path:
    """Write a video of the patch."""
    return write_video(path, moving(count, size), options={"crf": "12"})


def box_at(frame: int) -> BoundingBox:
    """Where the patch is."""
    return BoundingBox(20 + STEP * frame, 40, 24, 24)


def keyframe_at(frame: int) -> Keyframe:
    """The true keyframe."""
    return Keyframe(frame, box_at(frame))


def patch_job(path: Path, *frames: int, video_id: str = "patch") -> VideoJob:
    """A job with true keyframes in these frames."""
    keyframes = tuple(keyframe_at(frame) for frame in frames)
    return VideoJob(video_id, path, (Track(1, "patch", keyframes, {"colour": "many"}),))
