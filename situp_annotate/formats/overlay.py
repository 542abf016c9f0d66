"""The overlay video: the picture with the labels drawn on it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Literal, Self, get_args

from situp_annotate.errors import RecipeError
from situp_annotate.formats.drawing import draw_labels
from situp_annotate.types import Frame, Track, TrackPoint, VideoInfo
from situp_annotate.video.writer import H264Writer

__all__ = ["OverlayOptions", "OverlaySink"]


Preset = Literal["ultrafast", "superfast", "veryfast", "faster", "fast", "medium"]
"""x264's presets, from the quickest to the smallest files."""


@dataclass(frozen=True, slots=True)
class OverlayOptions:
    """How ``overlay.mp4`` is encoded.

    Attributes
    ----------
    crf : int
        x264's quality, from 1 (best) to 51 (worst); 0 would be lossless, in a profile that
        browsers cannot play.
    preset : str
        x264's trade of speed for size.

    Raises
    ------
    RecipeError
        If ``crf`` is out of its range or ``preset`` unknown.
    """

    crf: int = 23
    preset: Preset = "superfast"

    def __post_init__(self) -> None:
        if not 1 <= self.crf <= 51:
            raise RecipeError(f"crf = {self.crf} is not allowed: give from 1 to 51.")
        if self.preset not in get_args(Preset):
            allowed = ", ".join(get_args(Preset))
            raise RecipeError(f"preset = {self.preset!r} is not allowed: give one of {allowed}.")


class OverlaySink:
    """Writes ``overlay.mp4``.

    Parameters
    ----------
    path : Path
        File to write.
    info : VideoInfo
        The video.
    tracks : sequence of Track
        Every track whose points may come.
    options : OverlayOptions
        How to encode.
    """

    def __init__(
        self,
        path: Path,
        *,
        info: VideoInfo,
        tracks: Sequence[Track],
        options: OverlayOptions | None = None,
    ) -> None:
        options = options or OverlayOptions()
        self._tracks = {track.id: track for track in tracks}
        self._writer = H264Writer(
            path,
            width=info.width,
            height=info.height,
            frame_rate=info.frame_rate,
            crf=options.crf,
            preset=options.preset,
            pixel_aspect_ratio=info.pixel_aspect_ratio,
        )

    @property
    def wants_pictures(self) -> bool:
        """True: they are what is drawn on."""
        return True

    def write(self, frame: Frame, points: Sequence[TrackPoint]) -> None:
        """Draw the labels of one frame and encode it at its time."""
        pairs = [(self._tracks[point.track_id], point) for point in points]
        self._writer.write(draw_labels(frame.image, frame.index, pairs), frame.pts_ns)

    def __enter__(self) -> Self:
        self._writer.__enter__()
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._writer.__exit__(exc_type, exc, traceback)
