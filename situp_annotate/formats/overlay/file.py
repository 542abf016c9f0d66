"""The video file that overlays are: painted pictures in, mp4 out."""

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from situp_annotate.formats.overlay.drawing import draw_title
from situp_annotate.formats.overlay.options import OverlayOptions
from situp_annotate.formats.overlay.stretches import Excerpt
from situp_annotate.types import Frame, Image, VideoInfo
from situp_annotate.video.writer import H264Writer

__all__ = ["OverlayFile"]


class OverlayFile:
    """Encodes the painted pictures of an overlay: all of them, or those of some stretches.

    Where there are no stretches to show, the first picture stands alone and says so. A context
    manager; what it writes is finished when it is left normally.

    Parameters
    ----------
    path : Path
        File to write.
    info : VideoInfo
        The video.
    size_hw : tuple of int
        Height and width of the painted pictures.
    options : OverlayOptions
        How to encode.
    stretches : sequence of range, optional
        Frames to show, as `doubtful_stretches` finds them; all by default.
    background : bool
        As of `H264Writer`.
    """

    def __init__(
        self,
        path: Path,
        *,
        info: VideoInfo,
        size_hw: tuple[int, int],
        options: OverlayOptions,
        stretches: Sequence[range] | None = None,
        background: bool = False,
    ) -> None:
        self._excerpt = None if stretches is None else Excerpt(stretches or (range(1),), info)
        self._remark = f"confidence is never below {options.below:g}" if stretches == () else None
        whole = stretches is None and info.timestamps == "stream"
        height, width = size_hw
        self._writer = H264Writer(
            path,
            width=width,
            height=height,
            frame_rate=info.frame_rate,
            crf=options.crf,
            preset=options.preset,
            pixel_aspect_ratio=info.pixel_aspect_ratio,
            sound=info.path if options.sound and whole else None,
            background=background,
        )

    def time_of(self, frame: Frame) -> int | None:
        """When a frame is shown, in nanoseconds; None if it is not. Frames come in order."""
        return frame.pts_ns if self._excerpt is None else self._excerpt.time_of(frame)

    def add(self, image: Image, time_ns: int) -> None:
        """Add a painted picture, which must not be changed any more, at the time it is shown."""
        if self._remark:
            draw_title(image, self._remark)
        self._writer.write(image, time_ns)

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
