"""How a track looks: the same in every output and every run."""

import colorsys
from typing import Literal

from situp_annotate.types import Provenance, State, Track, TrackPoint

__all__ = ["Captions", "caption", "track_color"]

Captions = Literal["full", "id", "none"]
"""How much stands beside a box: everything, its track's id, or nothing."""

_GOLDEN_RATIO = 0.618033988749895
_FIRST_HUE = 0.08


def track_color(track_id: int) -> tuple[int, int, int]:
    """Red, green, blue (0–255) of a track; neighbouring ids are far apart in hue.

    Steps of the golden ratio never repeat a hue; saturation and lightness alternate a little so
    that hues that come near after many ids still differ.
    """
    hue = (_FIRST_HUE + track_id * _GOLDEN_RATIO) % 1.0
    lightness = (0.56, 0.66, 0.48)[track_id % 3]
    red, green, blue = colorsys.hls_to_rgb(hue, lightness, 0.95)
    return round(255 * red), round(255 * green), round(255 * blue)


def caption(track: Track, point: TrackPoint, detail: Captions = "full") -> str:
    """Text beside a box: id, label, the confidence or that a person drew it, and the state.

    The state is left out where the object is visible; less detail leaves out more.
    """
    if detail == "none":
        return ""
    if detail == "id":
        return f"#{track.id}"
    trust = "key" if point.provenance is Provenance.HUMAN else f"{point.confidence:.2f}"
    state = "" if point.state is State.VISIBLE else f" {point.state}"
    return f"#{track.id} {track.label} {trust}{state}"
