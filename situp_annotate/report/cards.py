"""What a video's page shows of a track: values that its template reads."""

import json
from dataclasses import dataclass
from typing import Any

from situp_annotate.propagation import Suggestion
from situp_annotate.report.strips import Figures, Strip
from situp_annotate.types import State, Track, TrackPoint

__all__ = ["Card", "Shown"]


@dataclass(frozen=True, slots=True)
class Shown:
    """A frame of a track that the page shows on its own.

    Attributes
    ----------
    point : TrackPoint
        The label in this frame.
    frame : int
        Index of the frame.
    seconds : float
        Its time.
    place : float
        Where it is on a strip, in percent.
    picture : str or None
        Its thumbnail, as a ``data:`` address; None where the page has no room for it.
    rank : int or None
        Place of the suggestion among all of the video, from 1.
    suggestion : Suggestion or None
        Why it is worth a look; None for those that only show how the track goes on.
    """

    point: TrackPoint
    frame: int
    seconds: float
    place: float
    picture: str | None
    rank: int | None = None
    suggestion: Suggestion | None = None

    @property
    def snippet(self) -> str:
        """The keyframe that the box of now would be, as the manifest has it."""
        box = self.point.box
        numbers = [round(each, 2) for each in (box.x, box.y, box.width, box.height)]
        keyframe: dict[str, Any] = {"frame": self.frame, "box": numbers}
        if self.point.state is State.OCCLUDED:
            keyframe["occluded"] = True
        return json.dumps(keyframe)


@dataclass(frozen=True, slots=True)
class Card:
    """All that the page says of one track.

    Attributes
    ----------
    track : Track
        The track.
    color : str
        Its colour in all outputs, as ``#rrggbb``.
    figures : Figures
        What is counted.
    strip : Strip
        What is drawn.
    keyframes : tuple of (int, float, bool)
        Frame and place of each keyframe that was used, and whether the object leaves there.
    suggestions : tuple of Shown
        Frames worth a look, best first.
    steps : tuple of Shown
        Regular steps through the others, in order.
    """

    track: Track
    color: str
    figures: Figures
    strip: Strip
    keyframes: tuple[tuple[int, float, bool], ...]
    suggestions: tuple[Shown, ...]
    steps: tuple[Shown, ...]

    @property
    def gain(self) -> float:
        """What all suggestions together are expected to mend, in frames."""
        return sum(each.suggestion.gain for each in self.suggestions if each.suggestion)

    @property
    def text(self) -> str:
        """What a search looks through."""
        attributes = (f"{key} {value}" for key, value in self.track.attributes.items())
        return " ".join([f"#{self.track.id}", self.track.label, *attributes])
