"""The pictures of an overlay: the video's frames with the labels drawn on them."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from situp_annotate.formats.overlay.drawing import draw_labels
from situp_annotate.formats.overlay.options import OverlayOptions
from situp_annotate.formats.overlay.trails import Trails
from situp_annotate.types import BoundingBox, Frame, Image, Track, TrackPoint

__all__ = ["Painter"]


class Painter:
    """Draws the labels of one video, frame by frame.

    Parameters
    ----------
    tracks : sequence of Track
        Every track whose points may come.
    size_hw : tuple of int
        Height and width of the video's pictures.
    options : OverlayOptions
        What to draw.

    Attributes
    ----------
    size_hw : tuple of int
        Height and width of the painted pictures.
    """

    def __init__(
        self, tracks: Sequence[Track], size_hw: tuple[int, int], options: OverlayOptions
    ) -> None:
        self._tracks = {track.id: track for track in options.shown(tracks)}
        self.size_hw = options.size_hw(*size_hw)
        self._scale_xy = (self.size_hw[1] / size_hw[1], self.size_hw[0] / size_hw[0])
        self._captions = options.captions
        self._trails = Trails(options.trails)

    def note(self, frame: Frame, points: Sequence[TrackPoint]) -> list[tuple[Track, TrackPoint]]:
        """Take in the labels of a frame, painted or not; frames must come in order.

        Returns
        -------
        list of (Track, TrackPoint)
            What of it is shown, in pixels of the painted picture.
        """
        shown = [self._scaled(point) for point in points if point.track_id in self._tracks]
        self._trails.note(frame, shown)
        return [(self._tracks[point.track_id], point) for point in shown]

    def paint(self, frame: Frame, points: Sequence[TrackPoint]) -> Image:
        """Take in the labels of a frame, and draw them.

        Returns
        -------
        Image
            (height, width, 3), in the order B, G, R; the frame's own picture stays as it is.
        """
        pairs = self.note(frame, points)
        trails = {track.id: self._trails.of(track.id, frame) for track, _ in pairs}
        return draw_labels(
            self._resized(frame.image),
            frame.index,
            pairs,
            captions=self._captions,
            trails={track_id: trail for track_id, trail in trails.items() if trail},
        )

    def _scaled(self, point: TrackPoint) -> TrackPoint:
        x, y = self._scale_xy
        if x == y == 1:
            return point
        box = point.box
        return replace(point, box=BoundingBox(box.x * x, box.y * y, box.width * x, box.height * y))

    def _resized(self, image: Image) -> Image:
        height, width = self.size_hw
        if image.shape[:2] == (height, width):
            return image
        small = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
        return np.asarray(small, np.uint8)
