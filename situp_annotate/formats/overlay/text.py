"""Lines of text on a filled ground, drawn for every frame of a video and therefore quickly."""

from dataclasses import dataclass
from functools import cache, lru_cache

import cv2
import numpy as np
from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from situp_annotate.types import Image

__all__ = ["DARK", "Color", "paste", "text_tag"]

Color = tuple[int, int, int]
"""Blue, green, red, as OpenCV draws."""

DARK: Color = (20, 20, 20)
_LIGHT: Color = (255, 255, 255)
_WEIGHT = 400
"""Regular; OpenCV's font is light unless told."""
_PRINTABLE = "".join(map(chr, range(32, 127)))


@dataclass(frozen=True, slots=True)
class _Typeface:
    """The printable ASCII characters in one size, side by side.

    Attributes
    ----------
    coverage : Image
        (line height, width of all): 255 where a character covers the pixel wholly.
    columns : dict of str to slice
        Where each character is.
    """

    coverage: Image
    columns: dict[str, slice]

    def write(self, text: str) -> list[Image]:
        """The characters of a text; a space for those that are not printable."""
        space = self.columns[" "]
        return [self.coverage[:, self.columns.get(letter, space)] for letter in text]


def _line_height(size: int) -> int:
    return round(1.25 * size)


def _with_pillow(text: str, size: int) -> Image:
    font = ImageFont.load_default(size)
    line = " ".join(text.splitlines())
    canvas = Pillow.new("L", (max(round(font.getlength(line)), 1), _line_height(size)))
    ImageDraw.Draw(canvas).text((0, 0), line, fill=255, font=font)
    return np.asarray(canvas, np.uint8)


def _with_opencv(text: str, size: int) -> Image:
    face = _opencv_face()
    _, _, width, _ = cv2.getTextSize((0, 0), text, (0, 0), face, size, _WEIGHT)
    canvas = np.zeros((_line_height(size), max(width, 1)), np.uint8)
    cv2.putText(canvas, text, (0, round(0.98 * size)), (255, 255, 255), face, size, _WEIGHT)
    return canvas


@cache
def _opencv_face() -> "cv2.FontFace":
    return cv2.FontFace("sans")


@lru_cache(maxsize=16)
def _typeface(size: int) -> _Typeface:
    """Characters are cached, whole tags are not, deliberately.

    Tags that outlive their frame sit between the blocks of freed pictures and keep the allocator
    from using them again, 6 MB with every frame of 1080p.
    """
    glyphs = [_with_pillow(letter, size) for letter in _PRINTABLE]
    ends = np.cumsum([glyph.shape[1] for glyph in glyphs]).tolist()
    starts = [0, *ends[:-1]]
    columns = {
        letter: slice(*place) for letter, *place in zip(_PRINTABLE, starts, ends, strict=True)
    }
    return _Typeface(np.hstack(glyphs), columns)


def _coverage(text: str, size: int) -> list[Image]:
    """What the text covers, piece by piece.

    Pillow's own font is the same everywhere, but knows little beyond ASCII; OpenCV's, which knows
    more, comes with OpenCV 5. Without it such letters are drawn as boxes.
    """
    if text.isascii():
        return _typeface(size).write(text)
    return [(_with_opencv if hasattr(cv2, "FontFace") else _with_pillow)(text, size)]


def _ink_on(color: Color) -> Color:
    blue, green, red = color
    return DARK if 0.114 * blue + 0.587 * green + 0.299 * red > 128 else _LIGHT


@lru_cache(maxsize=256)
def _shades(color: Color) -> Image:
    """(256, 3): a ground of this colour, covered by ink from not at all to wholly."""
    ink = np.linspace(0, 1, 256)[:, None]
    return np.rint((1 - ink) * color + ink * _ink_on(color)).astype(np.uint8)


def text_tag(text: str, size: int, color: Color, *, margin: int = 0) -> Image:
    """Write a line of text on a filled ground.

    Parameters
    ----------
    text : str
        One line.
    size : int
        Of the font, in pixels.
    color : Color
        Of the ground; the ink is dark or light, as can be read on it.
    margin : int
        Pixels to the left and to the right of the text.

    Returns
    -------
    Image
        (height, width, 3), in the order B, G, R; as high as every other tag of this size.
    """
    blank = np.zeros((_line_height(size), margin), np.uint8)
    coverage = np.hstack([blank, *_coverage(text, size), blank])
    return _shades(color).take(coverage, axis=0)


def paste(image: Image, piece: Image, corner_xy: tuple[int, int]) -> None:
    """Put a smaller picture into a picture, cut off at its right and lower edge.

    Parameters
    ----------
    image : Image
        (height, width, 3); changed.
    piece : Image
        (height, width, 3).
    corner_xy : tuple of int
        Where its top-left pixel goes: column and row, inside `image`.
    """
    x, y = corner_xy
    area = image[y : y + piece.shape[0], x : x + piece.shape[1]]
    area[:] = piece[: area.shape[0], : area.shape[1]]
