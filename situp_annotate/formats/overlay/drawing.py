"""Draw labels on a picture: boxes, tags, marks; legible from 320×240 to 4K."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from situp_annotate.formats.appearance import Captions, caption, track_color
from situp_annotate.formats.overlay.text import DARK, Color, paste, text_tag
from situp_annotate.formats.overlay.trails import Trail, draw_trail
from situp_annotate.types import BoundingBox, Image, Provenance, State, Track, TrackPoint

__all__ = ["draw_labels", "draw_title"]

_FAR = 100_000
"""Pixels; a box may lie anywhere, OpenCV's integers may not."""


@dataclass(frozen=True, slots=True)
class _Pen:
    """Sizes in pixels that suit a picture."""

    line: int
    font: int
    margin: int

    @classmethod
    def for_picture(cls, height: int, width: int) -> "_Pen":
        side = min(height, width)
        font = max(12, round(side / 30))
        return cls(line=max(2, round(side / 240)), font=font, margin=max(2, font // 5))


def _blue_green_red(track_id: int) -> Color:
    red, green, blue = track_color(track_id)
    return blue, green, red


def _dimmed(color: Color) -> Color:
    blue, green, red = ((level + dark) // 2 for level, dark in zip(color, DARK, strict=True))
    return blue, green, red


def _color(track: Track, point: TrackPoint) -> Color:
    color = _blue_green_red(track.id)
    return _dimmed(color) if point.state is State.LOST else color


def _tag(text: str, pen: _Pen, color: Color) -> Image:
    return text_tag(text, pen.font, color, margin=pen.margin)


def _tag_corner(
    box: BoundingBox, tag_hw: tuple[int, ...], picture_hw: tuple[int, int]
) -> tuple[int, int]:
    """Above the box; else below; else inside; always within the picture."""
    tag_height, tag_width = tag_hw
    height, width = picture_hw
    above, below = box.y - tag_height, box.bottom
    y = above if above >= 0 else below if below + tag_height <= height else max(box.y, 0)
    x = min(max(box.x, 0), width - tag_width)
    return max(round(x), 0), max(min(round(y), height - tag_height), 0)


def _edges(box: BoundingBox) -> tuple[int, int, int, int]:
    """First and last column and row of the outline."""
    left, top, right, bottom = (
        round(min(max(value, -_FAR), _FAR))
        for value in (box.x, box.y, box.right - 1, box.bottom - 1)
    )
    return left, top, max(right, left), max(bottom, top)


def _draw_dashes(image: Image, edges: tuple[int, int, int, int], pen: _Pen, color: Color) -> None:
    dashes = _dashes(image, edges, 5 * pen.line)
    for width, ink in ((pen.line + 2, DARK), (pen.line, color)):
        for start, end in dashes:
            cv2.line(image, start, end, ink, width)


def _dashes(
    image: Image, edges: tuple[int, int, int, int], length: int
) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Both ends of each dash that may lie in the picture, gaps being as long."""
    left, top, right, bottom = edges
    height, width = image.shape[:2]
    across = [
        ((start, y), (min(start + length, right), y))
        for start in range(max(left, -length), min(right, width), 2 * length)
        for y in (top, bottom)
    ]
    down = [
        ((x, start), (x, min(start + length, bottom)))
        for start in range(max(top, -length), min(bottom, height), 2 * length)
        for x in (left, right)
    ]
    return across + down


def _draw_handles(image: Image, edges: tuple[int, int, int, int], pen: _Pen, color: Color) -> None:
    """Filled squares on the corners, as on a box that is being edited."""
    left, top, right, bottom = edges
    reach = 2 * pen.line + 1
    for x in (left, right):
        for y in (top, bottom):
            near, far = (x - reach, y - reach), (x + reach, y + reach)
            cv2.rectangle(image, near, far, color, cv2.FILLED)
            cv2.rectangle(image, near, far, DARK, 1)


def _draw_box(image: Image, track: Track, point: TrackPoint, pen: _Pen) -> None:
    color, edges = _color(track, point), _edges(point.box)
    if point.state is not State.VISIBLE:
        _draw_dashes(image, edges, pen, color)
    else:
        cv2.rectangle(image, edges[:2], edges[2:], DARK, pen.line + 2)
        cv2.rectangle(image, edges[:2], edges[2:], color, pen.line)
    if point.provenance is Provenance.HUMAN:
        _draw_handles(image, edges, pen, color)


def _draw_caption(image: Image, text: str, box: BoundingBox, pen: _Pen, color: Color) -> None:
    height, width = image.shape[:2]
    if text and box.intersects(width, height):
        tag = _tag(text, pen, color)
        paste(image, tag, _tag_corner(box, tag.shape[:2], (height, width)))


def draw_labels(
    image: Image,
    frame_index: int,
    pairs: Sequence[tuple[Track, TrackPoint]],
    *,
    captions: Captions = "full",
    trails: Mapping[int, Trail] | None = None,
) -> Image:
    """Draw the labels of a frame, and its number in the corner.

    Parameters
    ----------
    image : Image
        The picture, grey or colour; not changed.
    frame_index : int
        Index in decode order, from 0; written at the bottom left unless `captions` is "none".
    pairs : sequence of (Track, TrackPoint)
        What to draw. A person's boxes have handles on their corners and say "key"; occluded
        ones are dashed, lost ones dashed and dimmed, and both say so.
    captions : {"full", "id", "none"}
        How much stands beside the boxes.
    trails : mapping of int to Trail, optional
        Where tracks have been, by their ids; below the boxes.

    Returns
    -------
    Image
        (height, width, 3), in the order B, G, R.
    """
    drawn = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image.copy()
    picture = np.asarray(drawn, np.uint8)
    height, width = picture.shape[:2]
    pen = _Pen.for_picture(height, width)
    for track_id, trail in (trails or {}).items():
        draw_trail(picture, trail, _blue_green_red(track_id), pen.line)
    for track, point in pairs:
        _draw_box(picture, track, point, pen)
    for track, point in pairs:  # above all boxes, lest they be crossed out
        text = caption(track, point, captions)
        _draw_caption(picture, text, point.box, pen, _color(track, point))
    if captions != "none":
        number = _tag(f"frame {frame_index}", pen, DARK)
        paste(picture, number, (0, max(height - number.shape[0], 0)))
    return picture


def draw_title(image: Image, text: str) -> None:
    """Write a line into the top left corner of a picture, which is changed."""
    pen = _Pen.for_picture(*image.shape[:2])
    paste(image, _tag(text, pen, DARK), (0, 0))
