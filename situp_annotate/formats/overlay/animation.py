"""Short animated pictures, for chats and pages that do not play videos."""

from collections.abc import Sequence
from io import BytesIO
from typing import Literal

import numpy as np
from PIL import Image as Pillow

from situp_annotate.types import NS_PER_S, Image

__all__ = ["AnimationFormat", "encode_animation"]

AnimationFormat = Literal["gif", "webp"]

_PALETTE_FRAMES = 8
"""Frames that the colours of a GIF are chosen from."""
_WEBP_QUALITY = 75
_TICK_NS = NS_PER_S // 100
"""A GIF counts in hundredths of a second."""


def encode_animation(
    images: Sequence[Image], times_ns: Sequence[int], form: AnimationFormat
) -> bytes:
    """Make an animated picture that plays over and over.

    Parameters
    ----------
    images : sequence of Image
        At least one; all (h, w, 3) in the order B, G, R, of one size.
    times_ns : sequence of int
        When each is shown, and one more: when the last one ends.
    form : {"gif", "webp"}
        File format.

    Returns
    -------
    bytes
        The file's content.
    """
    pictures = [Pillow.fromarray(np.ascontiguousarray(image[..., ::-1])) for image in images]
    if form == "gif":
        pictures = _with_one_palette(pictures)
    ticks = np.rint(np.array(times_ns) / _TICK_NS).astype(int)  # so that errors do not add up
    durations_ms = (10 * np.maximum(np.diff(ticks), 1)).tolist()
    file = BytesIO()
    first, *others = pictures
    first.save(
        file,
        format=form.upper(),
        save_all=True,
        append_images=others,
        duration=durations_ms,
        loop=0,
        **({"quality": _WEBP_QUALITY, "method": 4} if form == "webp" else {}),
    )
    return file.getvalue()


def _with_one_palette(pictures: Sequence[Pillow.Image]) -> list[Pillow.Image]:
    """The pictures in the same 256 colours, so that what stands still does not flicker."""
    step = -(-len(pictures) // _PALETTE_FRAMES)
    some = Pillow.fromarray(np.vstack([np.asarray(picture) for picture in pictures[::step]]))
    # Median cut would lose small things in colours of their own, such as boxes.
    palette = some.quantize(256, method=Pillow.Quantize.FASTOCTREE)
    return [picture.quantize(palette=palette, dither=Pillow.Dither.NONE) for picture in pictures]
