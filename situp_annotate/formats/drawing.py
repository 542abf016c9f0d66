"""Draw labels on a picture: boxes, tags, marks; legible from 320×240 to 4K."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from situp_annotate.formats.appearance import caption, track_color
from situp_annotate.types import BoundingBox, Image, Provenance, State, Track, TrackPoint

__all__ = ["draw_labels"]

Color = tuple[int, int, int]
"""Blue, green, red, as OpenCV draws."""

_DARK: Color = (20, 20, 20)
_LIGHT: Color = (255, 255, 255)
_WEIGHT = 400
"""Regular; OpenCV's font is light unless told."""
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
        font = max(11, round(side / 30))
        return cls(line=max(2, round(side / 240)), font=font, margin=max(2, font // 5))


@lru_cache(maxsize=16)
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


def _blue_green_red(track_id: int) -> Color:
    red, green, blue = track_color(track_id)
    return blue, green, red


def _ink_on(color: Color) -> Color:
    blue, green, red = color
    return _DARK if 0.114 * blue + 0.587 * green + 0.299 * red > 128 else _LIGHT


def _write_ascii(text: str, pen: _Pen, color: Color) -> Image:
    font = _font(pen.font)
    width = round(font.getlength(text)) + 2 * pen.margin
    canvas = Pillow.new("RGB", (width, round(1.25 * pen.font)), color)
    ImageDraw.Draw(canvas).text((pen.margin, 0), text, fill=_ink_on(color), font=font)
    return np.asarray(canvas, np.uint8)  # three channels in our order: Pillow only stores them


def _write_unicode(text: str, pen: _Pen, color: Color) -> Image:
    face = cv2.FontFace("sans")
    _, _, text_width, _ = cv2.getTextSize((0, 0), text, (0, 0), face, pen.font, _WEIGHT)
    canvas = np.full((round(1.25 * pen.font), text_width + 2 * pen.margin, 3), color, np.uint8)
    baseline = (pen.margin, round(0.98 * pen.font))
    cv2.putText(canvas, text, baseline, _ink_on(color), face, pen.font, _WEIGHT)
    return canvas


def _tag(text: str, pen: _Pen, color: Color) -> Image:
    """A line of text on a filled ground, (height, width, 3); all of a size are as high.

    Pillow's own font is the same everywhere, but knows little beyond ASCII; OpenCV's, which knows
    more, comes with OpenCV 5. Without it such letters are drawn as boxes.

    Deliberately not cached: tags that outlive their frame sit between the blocks of freed pictures
    and keep the allocator from using them again, 6 MB with every frame of 1080p.
    """
    wide = not text.isascii() and hasattr(cv2, "FontFace")
    return (_write_unicode if wide else _write_ascii)(text, pen, color)


def _paste(image: Image, tag: Image, corner_xy: tuple[int, int]) -> None:
    """Put a tag into a picture, cut off at its edges."""
    x, y = corner_xy
    area = image[y : y + tag.shape[0], x : x + tag.shape[1]]
    area[:] = tag[: area.shape[0], : area.shape[1]]


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


def _dimmed(color: Color) -> Color:
    blue, green, red = ((level + dark) // 2 for level, dark in zip(color, _DARK, strict=True))
    return blue, green, red


def _draw_dashes(image: Image, edges: tuple[int, int, int, int], pen: _Pen, color: Color) -> None:
    left, top, right, bottom = edges
    height, width = image.shape[:2]
    dash = 5 * pen.line
    for start in range(max(left, -dash), min(right, width), 2 * dash):
        for y in (top, bottom):
            cv2.line(image, (start, y), (min(start + dash, right), y), color, pen.line)
    for start in range(max(top, -dash), min(bottom, height), 2 * dash):
        for x in (left, right):
            cv2.line(image, (x, start), (x, min(start + dash, bottom)), color, pen.line)


def _draw_handles(image: Image, edges: tuple[int, int, int, int], pen: _Pen, color: Color) -> None:
    """Filled squares on the corners, as on a box that is being edited."""
    left, top, right, bottom = edges
    reach = 2 * pen.line + 1
    for x in (left, right):
        for y in (top, bottom):
            near, far = (x - reach, y - reach), (x + reach, y + reach)
            cv2.rectangle(image, near, far, color, cv2.FILLED)
            cv2.rectangle(image, near, far, _DARK, 1)


def _draw_point(image: Image, track: Track, point: TrackPoint, pen: _Pen) -> None:
    color, edges = _blue_green_red(track.id), _edges(point.box)
    if point.state is State.LOST:
        color = _dimmed(color)
    if point.state is not State.VISIBLE:
        _draw_dashes(image, edges, pen, color)
    else:
        cv2.rectangle(image, edges[:2], edges[2:], _DARK, pen.line + 2)
        cv2.rectangle(image, edges[:2], edges[2:], color, pen.line)
    if point.provenance is Provenance.HUMAN:
        _draw_handles(image, edges, pen, color)
    height, width = image.shape[:2]
    if point.box.intersects(width, height):
        tag = _tag(caption(track, point), pen, color)
        _paste(image, tag, _tag_corner(point.box, tag.shape[:2], (height, width)))


def draw_labels(image: Image, frame_index: int, pairs: Sequence[tuple[Track, TrackPoint]]) -> Image:
    """Draw the labels of a frame, and its number in the corner.

    Parameters
    ----------
    image : Image
        The picture, grey or colour; not changed.
    frame_index : int
        Index in decode order, from 0; written at the bottom left.
    pairs : sequence of (Track, TrackPoint)
        What to draw. A person's boxes have handles on their corners and say "key"; occluded
        ones are dashed, lost ones dashed and dimmed, and both say so.

    Returns
    -------
    Image
        (height, width, 3), in the order B, G, R.
    """
    drawn = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image.copy()
    picture = np.asarray(drawn, np.uint8)
    height, width = picture.shape[:2]
    pen = _Pen.for_picture(height, width)
    for track, point in pairs:
        _draw_point(picture, track, point, pen)
    number = _tag(f"frame {frame_index}", pen, _DARK)
    _paste(picture, number, (0, max(height - number.shape[0], 0)))
    return picture
