"""The values that flow through the house: boxes, frames, tracks, and what is said of them.

All are frozen, check themselves, and can be pickled. Conventions that hold everywhere:

* A box is ``x, y, width, height`` in pixels, 0-based, as floats. ``(0, 0)`` is the top-left
  corner of the top-left pixel; the box covers ``[x, x + width) × [y, y + height)``.
* A frame's index is its place in decode order, from 0.
* Time is integer nanoseconds from the start of the stream.
"""

from dataclasses import dataclass, field
from enum import StrEnum
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from situp_annotate.errors import BoxError

__all__ = [
    "MOST_PIXELS",
    "NS_PER_S",
    "BoundingBox",
    "Extend",
    "Finding",
    "Frame",
    "Image",
    "Keyframe",
    "Method",
    "Provenance",
    "State",
    "Track",
    "TrackPoint",
    "VideoInfo",
    "VideoJob",
]

MOST_PIXELS = 1_000_000_000
"""Largest number in a box, whatever its sign: a box's area is a number, too."""

NS_PER_S = 1_000_000_000
"""Nanoseconds, in which all times are."""

Image = npt.NDArray[np.uint8]
"""A picture: uint8, (height, width) grey or (height, width, 3) in OpenCV's order B, G, R."""


@dataclass(frozen=True, slots=True)
class BoundingBox:
    """An upright rectangle in pixels, 0-based; the corner may lie outside the picture.

    Raises
    ------
    BoxError
        If a number is not finite or beyond `MOST_PIXELS`, or width or height is not positive.
    """

    x: float
    y: float
    width: float
    height: float

    def __post_init__(self) -> None:
        numbers = (self.x, self.y, self.width, self.height)
        if not all(abs(number) <= MOST_PIXELS for number in numbers):
            raise BoxError(
                f"A box needs four finite numbers of at most {MOST_PIXELS}, not {list(numbers)}."
            )
        if self.width <= 0 or self.height <= 0:
            raise BoxError(f"A box needs a positive width and height, not {list(numbers)}.")

    @property
    def right(self) -> float:
        """First coordinate to the right of the box."""
        return self.x + self.width

    @property
    def bottom(self) -> float:
        """First coordinate below the box."""
        return self.y + self.height

    def intersects(self, width: float, height: float) -> bool:
        """Whether any of the box lies inside a picture of this size."""
        return self.x < width and self.y < height and self.right > 0 and self.bottom > 0


@dataclass(frozen=True, slots=True)
class Finding:
    """Something about a video that its user should know, though work could go on.

    Attributes
    ----------
    kind : str
        A short stable word for machines, such as ``"gap"``.
    message : str
        A finished sentence for people.
    frame : int or None
        Index of the frame where it was found; None when it concerns the whole video.
    """

    kind: str
    message: str
    frame: int | None = None


@dataclass(frozen=True, slots=True)
class Frame:
    """One decoded picture.

    Attributes
    ----------
    index : int
        Place in decode order, from 0.
    pts_ns : int
        Presentation time in nanoseconds from the start of the stream; strictly increasing.
    image : Image
        The pixels, upright (rotation applied). Read-only by agreement. Empty, 0 × 0, where
        labels are written and nothing looks at the picture.
    findings : tuple of Finding
        What the source noticed between the frame before and this one.
    """

    index: int
    pts_ns: int
    image: Image
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True, slots=True)
class VideoInfo:
    """What is known of a video once it is open. Only what was decoded can be relied on.

    Attributes
    ----------
    path : Path
        The file, or the folder of pictures.
    decoder : str
        ``"opencv"``, ``"pyav"`` or ``"images"``: who decodes it.
    width, height : int
        Size in pixels of the upright picture.
    frame_rate : Fraction
        Average frames per second; for display and for files that demand one, never for indexing.
    frame_count_from_header : int or None
        What the container promises; often wrong. A hint for progress bars.
    rotation_degrees : int
        Clockwise rotation that was applied to make the picture upright: 0, 90, 180 or 270.
    codec : str
        Name of the codec, such as ``"h264"``; ``"images"`` for a folder.
    pixel_aspect_ratio : Fraction
        Width of a pixel over its height, in the upright picture. Pixels are never rescaled.
    timestamps : str
        ``"stream"`` when the frames carry their own times, ``"frame_rate"`` when the stream has
        none that can be used and times are index ÷ frame rate.
    """

    path: Path
    decoder: str
    width: int
    height: int
    frame_rate: Fraction
    frame_count_from_header: int | None = None
    rotation_degrees: int = 0
    codec: str = "unknown"
    pixel_aspect_ratio: Fraction = Fraction(1)
    timestamps: str = "stream"


@dataclass(frozen=True, slots=True)
class Keyframe:
    """What a person said of a track at one frame.

    Attributes
    ----------
    frame : int
        Index of the frame, from 0.
    box : BoundingBox or None
        Where the object is; None says that it has left the picture (``outside``), until a
        keyframe with a box.
    occluded : bool
        Whether the object is hidden, wholly or in part, from here to the next keyframe.
    """

    frame: int
    box: BoundingBox | None
    occluded: bool = False


class Method(StrEnum):
    """How boxes come about between keyframes: by tracking, or without looking at the picture."""

    SITUP = "situp"
    LINEAR = "linear"
    CUBIC = "cubic"
    HOLD = "hold"


class Extend(StrEnum):
    """Where a track goes on beyond its keyframes."""

    FORWARD = "forward"
    BOTH = "both"


@dataclass(frozen=True, slots=True)
class Track:
    """One object of one video and the keyframes a person gave it.

    Attributes
    ----------
    id : int
        At least 1, unique in the video.
    label : str
        Name of the object's class.
    keyframes : tuple of Keyframe
        At least one, in increasing order of frames.
    attributes : dict
        Free key–value pairs that travel with the track.
    method : Method or None
        How the boxes between keyframes come about; None leaves it to the recipe.
    extend : Extend or None
        Whether there are boxes before the first keyframe too; None leaves it to the recipe.
    """

    id: int
    label: str
    keyframes: tuple[Keyframe, ...]
    attributes: dict[str, Any] = field(default_factory=dict)
    method: Method | None = None
    extend: Extend | None = None


class State(StrEnum):
    """How the object is seen in a frame."""

    VISIBLE = "visible"
    OCCLUDED = "occluded"
    LOST = "lost"


class Provenance(StrEnum):
    """Where a box comes from."""

    HUMAN = "human"
    TRACKED = "tracked"
    INTERPOLATED = "interpolated"


@dataclass(frozen=True, slots=True)
class TrackPoint:
    """One track in one frame: the label that situp-annotate gives.

    Attributes
    ----------
    track_id : int
        The track's id in its video.
    box : BoundingBox
        Where the object is.
    confidence : float
        Probability to overlap the object by half at least, in [0, 1]; 1 for boxes that a person
        drew.
    state : State
        How the object is seen; the box of a lost one is where it is searched for.
    provenance : Provenance
        Whether a person drew the box, the tracker found it, or it was put between others.
    apce : float or None
        Average peak-to-correlation energy of the winning response; of tracked boxes only.
    peak : float or None
        Highest value of the winning response; of tracked boxes only.
    scale : float or None
        The object's size over its size at the keyframe it is tracked from; of tracked boxes only.
    """

    track_id: int
    box: BoundingBox
    confidence: float
    state: State
    provenance: Provenance
    apce: float | None = None
    peak: float | None = None
    scale: float | None = None


@dataclass(frozen=True, slots=True)
class VideoJob:
    """One video to annotate: what a worker process is given.

    Attributes
    ----------
    id : str
        Names the output folder; unique in the batch, a single path component.
    path : Path
        The video file, or a folder of pictures.
    tracks : tuple of Track
        The tracks to propagate; none is allowed.
    manifest_sha256 : str or None
        Hash of the manifest file that the job comes from; None when it was made in code.
    frame_count_hint : int or None
        How many frames the manifest says there are: for guessing how long it will take.
    size_hint_hw : tuple of int or None
        Height and width that the manifest says they have: for guessing how much memory.
    """

    id: str
    path: Path
    tracks: tuple[Track, ...]
    manifest_sha256: str | None = None
    frame_count_hint: int | None = None
    size_hint_hw: tuple[int, int] | None = None
