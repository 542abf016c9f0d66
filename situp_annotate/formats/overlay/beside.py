"""Two overlays of the same video in one picture, left and right."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from situp_annotate.formats.overlay.drawing import draw_title
from situp_annotate.formats.overlay.file import OverlayFile
from situp_annotate.formats.overlay.options import OverlayOptions
from situp_annotate.formats.overlay.painter import Painter
from situp_annotate.types import Frame, Track, TrackPoint, VideoInfo

__all__ = ["BesideSink", "Side"]

_GAP = 4
"""Pixels between the pictures."""


@dataclass(frozen=True, slots=True)
class Side:
    """One of the two.

    Attributes
    ----------
    title : str
        Stands in the picture.
    tracks : tuple of Track
        Every track whose points may come.
    """

    title: str
    tracks: tuple[Track, ...]


class BesideSink(OverlayFile):
    """Writes a video with the same frames twice, beside each other, each with its own labels.

    Parameters
    ----------
    path : Path
        File to write.
    info : VideoInfo
        The video.
    sides : tuple of Side
        Left and right.
    options, stretches, background
        As of `OverlayFile`.
    """

    def __init__(
        self,
        path: Path,
        *,
        info: VideoInfo,
        sides: tuple[Side, Side],
        options: OverlayOptions,
        stretches: Sequence[range] | None = None,
        background: bool = False,
    ) -> None:
        size_hw = (info.height, info.width)
        self._titles = [side.title for side in sides]
        self._painters = [Painter(side.tracks, size_hw, options) for side in sides]
        height, width = self._painters[0].size_hw
        self._gap = np.zeros((height, _GAP, 3), np.uint8)
        super().__init__(
            path,
            info=info,
            size_hw=(height, 2 * width + _GAP),
            options=options,
            stretches=stretches,
            background=background,
        )

    def write(self, frame: Frame, left: Sequence[TrackPoint], right: Sequence[TrackPoint]) -> None:
        """Add a frame with the labels of both sides."""
        labels = list(zip(self._painters, (left, right), strict=True))
        time_ns = self.time_of(frame)
        if time_ns is None:
            for painter, points in labels:
                painter.note(frame, points)
            return
        pictures = [painter.paint(frame, points) for painter, points in labels]
        for picture, title in zip(pictures, self._titles, strict=True):
            draw_title(picture, title)
        self.add(np.hstack([pictures[0], self._gap, pictures[1]]), time_ns)
