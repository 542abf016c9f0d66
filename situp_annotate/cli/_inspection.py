"""Decode whole videos to learn what is in them: shared by ``check`` and ``init``."""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from situp_annotate.errors import VideoError

if TYPE_CHECKING:
    from situp_annotate.types import Finding, VideoInfo

__all__ = ["Inspection", "inspect_videos"]


@dataclass(frozen=True, slots=True)
class Inspection:
    """What decoding a video to its end has shown.

    Attributes
    ----------
    info : VideoInfo or None
        None when the video does not open.
    frame_count : int
        Frames that could be decoded.
    findings : tuple of Finding
        What the decoder noticed.
    error : VideoError or None
        Why the video cannot be annotated; None when it can.
    """

    info: "VideoInfo | None" = None
    frame_count: int = 0
    findings: "tuple[Finding, ...]" = ()
    error: VideoError | None = None

    @property
    def size(self) -> str:
        """Width and height in words for people."""
        return f"{self.info.width} × {self.info.height}" if self.info else "unknown size"


def _inspect(path: Path) -> Inspection:
    from situp_annotate.video import open_video

    error = None
    try:
        with open_video(path) as source:
            try:
                source.skip_through()
            except VideoError as raised:
                error = raised  # what came before still counts
            return Inspection(source.info, source.frames_decoded, source.findings, error)
    except VideoError as raised:
        return Inspection(error=raised)


def inspect_videos(paths: Sequence[Path]) -> Iterator[Inspection]:
    """Decode each video to its end, with a progress bar when stderr is a terminal."""
    from tqdm import tqdm

    with tqdm(total=len(paths), unit="video", leave=False, disable=not sys.stderr.isatty()) as bar:
        for path in paths:
            bar.set_postfix_str(path.name)
            yield _inspect(path)
            bar.update()
