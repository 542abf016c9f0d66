"""Clips whose pictures tell their own number, and tracks whose box is known in every frame."""

from fractions import Fraction
from pathlib import Path

import numpy as np

from situp_annotate.types import BoundingBox, Keyframe, Method, Track, VideoJob
from support.media import draw_index, write_video

__all__ = [
    "COUNT",
    "LABEL",
    "SIZE_HW",
    "TIMES_S",
    "box_at",
    "numbered_job",
    "write_cfr",
    "write_vfr",
]

SIZE_HW = (240, 320)
COUNT = 50
LABEL = '<b>"van"</b>'
_VFR_MS = [0, *np.cumsum(np.random.default_rng(2).choice([7, 33, 40, 210], COUNT - 1)).tolist()]
TIMES_S = {"cfr": [n / 30 for n in range(COUNT)], "vfr": [ms / 1000 for ms in _VFR_MS]}
"""Times of the frames of both clips."""


def write_cfr(path: Path) -> Path:
    """Write the clip at 30 frames a second."""
    return write_video(path, _pictures(), rate=30, options={"crf": "10"})


def write_vfr(path: Path) -> Path:
    """Write the clip at a variable frame rate."""
    ticks = Fraction(1, 1000)
    return write_video(path, _pictures(), pts=_VFR_MS, time_base=ticks, options={"crf": "10"})


def _pictures():
    return (draw_index(n, SIZE_HW) for n in range(COUNT))


def box_at(frame: int, top: int = 52) -> BoundingBox:
    """Where the first track is; the lines of the box keep off what tells the frame's number."""
    return BoundingBox(8 + 4 * frame, top, 40, 24)


def numbered_job(path: Path, video_id: str) -> VideoJob:
    """A job of three tracks, none of which needs a tracker."""

    def keyframes(*frames, top=52, hidden=()):
        return tuple(Keyframe(frame, box_at(frame, top), frame in hidden) for frame in frames)

    tracks = (
        Track(1, LABEL, keyframes(0, 49), {"colour": "red"}, Method.LINEAR),
        Track(2, "bus", keyframes(0, 10, 40, top=172), {}, Method.LINEAR),
        Track(3, "bus", keyframes(5, 15, top=112, hidden=[15]), {}, Method.LINEAR),
    )
    return VideoJob(video_id, path, tracks)
