"""What an import gives, and what it may have to be told."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from situp_annotate.types import Track

__all__ = ["ImportHints", "Seeds"]


@dataclass(frozen=True, slots=True)
class Seeds:
    """The boxes that a file gives for one video.

    Attributes
    ----------
    name : str
        Of the video or sequence, as the file says it; empty if it does not say.
    tracks : tuple of Track
        By id.
    notes : tuple of str
        What the reader had to decide, a finished sentence each.
    video_id : str
        Id of the video in the run that the boxes were exported from; empty if the file does not
        say.
    """

    name: str
    tracks: tuple[Track, ...]
    notes: tuple[str, ...] = ()
    video_id: str = ""


@dataclass(frozen=True, slots=True)
class ImportHints:
    """What a file may leave open.

    Attributes
    ----------
    label : str
        Of the objects, if the file names no classes.
    labels : mapping of int to str
        Names of class numbers.
    pixel_origin : int or None
        Coordinate of the picture's top-left corner in the file; None for the format's own.
    times_ns : callable
        Gives the time of each frame of a video, by the name that the file says.
    size_of : callable
        Gives width and height in pixels of a video's upright picture, by the same name.
    """

    label: str
    times_ns: Callable[[str], Sequence[int]]
    size_of: Callable[[str], tuple[int, int]]
    labels: Mapping[int, str] = field(default_factory=dict)
    pixel_origin: Literal[0, 1] | None = None
