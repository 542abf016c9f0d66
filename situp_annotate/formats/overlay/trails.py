"""Trails: the way that objects have come in the last seconds, fading the older it is."""

from collections import defaultdict, deque
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from situp_annotate.formats.overlay.text import Color
from situp_annotate.types import NS_PER_S, Frame, Image, State, TrackPoint

__all__ = ["Trail", "Trails", "draw_trail"]

_STRONGEST = 0.9
"""How much of the picture the young end of a trail covers; the old end covers nothing."""


@dataclass(frozen=True, slots=True)
class Trail:
    """Where one track has been.

    Attributes
    ----------
    centers_xy : tuple of (float, float)
        Centres of its boxes in pixels, the oldest first.
    ages : tuple of float
        Of each, from 0 (now) to 1 (as old as is shown).
    """

    centers_xy: tuple[tuple[float, float], ...]
    ages: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class _Place:
    frame: int
    time_ns: int
    center_xy: tuple[float, float]


class Trails:
    """Remembers where tracks have been.

    Parameters
    ----------
    seconds : float
        For how long; 0 for not at all.
    """

    def __init__(self, seconds: float) -> None:
        self._span_ns = round(seconds * NS_PER_S)
        self._places: defaultdict[int, deque[_Place]] = defaultdict(deque)

    def note(self, frame: Frame, points: Sequence[TrackPoint]) -> None:
        """Take in the labels of a frame; frames must come in order.

        A trail begins anew after frames without a box, or in which the object is lost.
        """
        if not self._span_ns:
            return
        for point in points:
            if point.state is State.LOST:
                continue
            places = self._places[point.track_id]
            if places and places[-1].frame != frame.index - 1:
                places.clear()
            box = point.box
            center_xy = (box.x + box.width / 2, box.y + box.height / 2)
            places.append(_Place(frame.index, frame.pts_ns, center_xy))
            while frame.pts_ns - places[0].time_ns > self._span_ns:
                places.popleft()

    def of(self, track_id: int, frame: Frame) -> Trail | None:
        """The trail of a track that leads to this frame, if there is one."""
        places = self._places.get(track_id)
        if not places or places[-1].frame != frame.index or len(places) < 2:
            return None
        return Trail(
            tuple(place.center_xy for place in places),
            tuple((frame.pts_ns - place.time_ns) / self._span_ns for place in places),
        )


def draw_trail(image: Image, trail: Trail, color: Color, line: int) -> None:
    """Draw a trail.

    Parameters
    ----------
    image : Image
        (height, width, 3); changed.
    trail : Trail
        What to draw.
    color : Color
        Its colour.
    line : int
        Its width in pixels.
    """
    height, width = image.shape[:2]
    # Far outside, OpenCV's integers would overflow.
    far = 10 * max(height, width)
    places = np.rint(np.clip(trail.centers_xy, -far, far)).astype(int)
    left, top = np.clip(places.min(axis=0) - line, 0, (width, height))
    right, bottom = np.clip(places.max(axis=0) + line + 1, 0, (width, height))
    if left >= right or top >= bottom:
        return
    area = image[top:bottom, left:right]
    strength = np.zeros(area.shape[:2], np.uint8)
    ends = (places - (left, top)).tolist()
    for start, end, age in zip(ends, ends[1:], trail.ages[1:], strict=False):
        cover = round(255 * _STRONGEST * (1 - age))
        cv2.line(strength, start, end, cover, line, cv2.LINE_AA)
    covered = strength > 0
    share = strength[covered, None] / np.float32(255)
    area[covered] = np.rint(area[covered] * (1 - share) + np.multiply(color, share))
