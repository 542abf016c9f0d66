"""The overlay video: the picture with the labels drawn on it."""

from collections.abc import Sequence
from pathlib import Path

from situp_annotate.formats.overlay.file import OverlayFile
from situp_annotate.formats.overlay.options import OverlayOptions
from situp_annotate.formats.overlay.painter import Painter
from situp_annotate.types import Frame, Track, TrackPoint, VideoInfo

__all__ = ["OverlaySink"]


class OverlaySink(OverlayFile):
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
        What to show, and how to encode it.
    stretches, background
        As of `OverlayFile`.
    """

    def __init__(
        self,
        path: Path,
        *,
        info: VideoInfo,
        tracks: Sequence[Track],
        options: OverlayOptions | None = None,
        stretches: Sequence[range] | None = None,
        background: bool = False,
    ) -> None:
        options = options or OverlayOptions()
        self._painter = Painter(tracks, (info.height, info.width), options)
        super().__init__(
            path,
            info=info,
            size_hw=self._painter.size_hw,
            options=options,
            stretches=stretches,
            background=background,
        )

    @property
    def wants_pictures(self) -> bool:
        """True: they are what is drawn on."""
        return True

    def write(self, frame: Frame, points: Sequence[TrackPoint]) -> None:
        """Draw the labels of one frame and encode it at its time."""
        time_ns = self.time_of(frame)
        if time_ns is None:
            self._painter.note(frame, points)
        else:
            self.add(self._painter.paint(frame, points), time_ns)
