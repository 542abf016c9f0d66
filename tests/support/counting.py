"""A video whose pictures spell their index, and labels whose boxes say it by where they are."""

from fractions import Fraction
from pathlib import Path

import numpy as np

from situp_annotate.formats.labelled import LabelledTrack, LabelledVideo
from situp_annotate.types import (
    BoundingBox,
    Image,
    Keyframe,
    Provenance,
    State,
    Track,
    TrackPoint,
)
from situp_annotate.video import open_video
from support.media import draw_index, write_video

__all__ = ["COUNT", "SIZE_HW", "VFR", "box_at", "box_index", "labelled", "write_counting"]

COUNT = 40
SIZE_HW = (480, 640)
_STEP = 14

_steps = [1, 1, 4, 1, 2, 1, 1, 9] * (COUNT // 8)
VFR = {"pts": [sum(_steps[:index]) for index in range(COUNT)], "time_base": Fraction(1, 30)}
"""For `write_counting`: uneven times."""


def box_at(index: int) -> BoundingBox:
    """The box of a frame; above the middles of the cells that spell the index."""
    return BoundingBox(8 + _STEP * index, 8, 24, 20)


def box_index(image: Image) -> int:
    """Read which frame's box is drawn, by its left edge."""
    scale = image.shape[1] / SIZE_HW[1]
    blue, green, red = np.moveaxis(image.astype(int), 2, 0)
    columns = ((blue > 180) & (green < 130) & (red < 150)).any(axis=0)
    return round((int(columns.argmax()) / scale - 8) / _STEP)


def write_counting(path: Path, **options: object) -> Path:
    """Write the video, with the options of `write_video`."""
    pictures = (draw_index(index, SIZE_HW) for index in range(COUNT))
    return write_video(path, pictures, **options)


def labelled(path: Path, *, confidence: dict[int, float] | None = None) -> LabelledVideo:
    """What a run might have found in it: track 1 of certain boxes, and track 2 that is lost.

    Parameters
    ----------
    path : Path
        The video.
    confidence : dict of int to float, optional
        Of track 1, by frame; 0.9 elsewhere.
    """
    with open_video(path) as source:
        times_ns = {frame.index: frame.pts_ns for frame in source}
        info = source.info
    sure, lost = {}, {}
    for index in times_ns:
        trust = (confidence or {}).get(index, 0.9)
        sure[index] = TrackPoint(1, box_at(index), trust, State.VISIBLE, Provenance.TRACKED)
        place = BoundingBox(300, 400, 60, 50)
        lost[index] = TrackPoint(2, place, 0.2, State.LOST, Provenance.TRACKED)
    tracks = [
        LabelledTrack(Track(number, name, (Keyframe(0, points[0].box),)), points)
        for number, name, points in ((1, "counter", sure), (2, "ghost", lost))
    ]
    return LabelledVideo("counting", info, len(times_ns), times_ns, tuple(tracks))
