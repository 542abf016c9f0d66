"""What an overlay video shows, and how it is encoded."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from situp_annotate.errors import RecipeError
from situp_annotate.formats.appearance import Captions
from situp_annotate.types import Track

__all__ = ["OverlayOptions"]


Preset = Literal["ultrafast", "superfast", "veryfast", "faster", "fast", "medium"]
"""x264's presets, from the quickest to the smallest files."""

_LEAST_HEIGHT = 16


@dataclass(frozen=True, slots=True)
class OverlayOptions:
    """What ``overlay.mp4`` shows, and how it is encoded.

    Attributes
    ----------
    captions : str
        What stands beside a box: ``"full"`` for id, label, confidence and state, ``"id"``, or
        ``"none"``, which leaves out the frame number too.
    trails : float
        For how many seconds the way of a box's centre is shown, fading; 0 for not at all.
    tracks : tuple of int or str
        Which tracks to show, by id or label; empty for all.
    below : float
        Show only stretches where a shown track's confidence is below this, from 0 to 1, joined
        together and without sound; 0 for the whole video.
    context : float
        Seconds that are shown before and after such a stretch, about.
    max_height : int
        In pixels; larger pictures are made smaller. 0 for no limit.
    sound : bool
        Whether the video's sound is taken along.
    crf : int
        x264's quality, from 1 (best) to 51 (worst); 0 would be lossless, in a profile that
        browsers cannot play.
    preset : str
        x264's trade of speed for size.

    Raises
    ------
    RecipeError
        If a value is out of its range.
    """

    captions: Captions = "full"
    trails: float = 0.0
    tracks: tuple[int | str, ...] = ()
    below: float = 0.0
    context: float = 1.0
    max_height: int = 0
    sound: bool = True
    crf: int = 23
    preset: Preset = "ultrafast"

    def __post_init__(self) -> None:
        for name in ("captions", "preset"):
            allowed = get_args({"captions": Captions, "preset": Preset}[name])
            if getattr(self, name) not in allowed:
                raise _refusal(name, repr(getattr(self, name)), f"one of {', '.join(allowed)}")
        for name in ("trails", "context"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise _refusal(name, value, "seconds, 0 or more")
        if not 0 <= self.below <= 1:
            raise _refusal("below", self.below, "from 0 to 1")
        if self.max_height and self.max_height < _LEAST_HEIGHT:
            raise _refusal("max_height", self.max_height, f"0, or at least {_LEAST_HEIGHT}")
        if not 1 <= self.crf <= 51:
            raise _refusal("crf", self.crf, "from 1 to 51")

    def shown(self, tracks: Sequence[Track]) -> tuple[Track, ...]:
        """Those tracks of a video that are shown."""
        chosen = self.tracks
        return tuple(
            track for track in tracks if not chosen or track.id in chosen or track.label in chosen
        )

    def size_hw(self, height: int, width: int) -> tuple[int, int]:
        """Height and width of the overlay of a video of this size; the aspect is kept."""
        if not 0 < self.max_height < height:
            return height, width
        return self.max_height, max(round(width * self.max_height / height), 1)


def _refusal(name: str, value: object, allowed: str) -> RecipeError:
    return RecipeError(f"{name} = {value} is not allowed: give {allowed}.")
