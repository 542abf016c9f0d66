"""A video that is walked through more than once: forward, backward, forward again."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

import numpy as np

from situp_annotate.errors import VideoError
from situp_annotate.limits import Limits
from situp_annotate.types import Finding, Frame, Image, VideoInfo
from situp_annotate.video.opening import open_video
from situp_annotate.video.prefetch import reading_ahead
from situp_annotate.video.rewinding import Rewinder
from situp_annotate.video.source import FrameSource

__all__ = ["ForwardWalk", "VideoFootage"]

_NO_PICTURE: Image = np.empty((0, 0), np.uint8)
_NO_PICTURE.setflags(write=False)


@dataclass(frozen=True, slots=True)
class ForwardWalk:
    """What a walk through all of a video leaves behind: everything but the pictures.

    Attributes
    ----------
    info : VideoInfo
        What is known of the video.
    times_ns : tuple of int
        ``pts_ns`` of every frame, by index.
    findings : tuple of Finding
        Everything that was noticed.
    findings_at : dict of int to tuple of Finding
        What came along with each frame, by index; frames without are left out.
    """

    info: VideoInfo
    times_ns: tuple[int, ...]
    findings: tuple[Finding, ...] = ()
    findings_at: dict[int, tuple[Finding, ...]] = field(default_factory=dict)

    def frames(self) -> Iterator[Frame]:
        """The frames once more, without decoding: their pictures are empty, 0 × 0 pixels."""
        for index, time_ns in enumerate(self.times_ns):
            yield Frame(index, time_ns, _NO_PICTURE, self.findings_at.get(index, ()))


class VideoFootage:
    """A file or folder of pictures that can be walked through in both directions.

    A context manager. The file stays open from one stretch backward to the next.

    Parameters
    ----------
    path : Path
        The file or folder; opened at once unless `walk` is given.
    incomplete : {"fail", "keep"}
        As of `open_video`.
    budget_bytes : int
        As of `Rewinder`: about how many bytes of decoded pictures a walk backward may hold.
    threads : int
        With more than one, walks forward decode ahead.
    limits : Limits, optional
        As of `open_video`.
    walk : ForwardWalk, optional
        Of the same video, from an earlier run; with it, walks backward need no walk forward.

    Attributes
    ----------
    info : VideoInfo
        What is known of the video.

    Raises
    ------
    VideoError
        As `open_video` does.
    """

    def __init__(
        self,
        path: Path,
        *,
        incomplete: Literal["fail", "keep"] = "fail",
        budget_bytes: int = 256 * 2**20,
        threads: int = 1,
        limits: Limits | None = None,
        walk: ForwardWalk | None = None,
    ) -> None:
        self._path = path
        self._threads = threads
        self._incomplete = incomplete
        self._limits = limits
        self._budget_bytes = budget_bytes
        self._walk = walk
        self._rewinder: Rewinder | None = None
        self._fresh: FrameSource | None = None
        if walk is None:
            self._fresh = self._open()
            self.info = self._fresh.info
        else:
            self.info = walk.info

    @property
    def size_hw(self) -> tuple[int, int]:
        """Height and width of the pictures in pixels."""
        return self.info.height, self.info.width

    @property
    def walk(self) -> ForwardWalk:
        """What the first walk forward has left behind.

        Raises
        ------
        ValueError
            If there was none up to the end.
        """
        if self._walk is None:
            raise ValueError(f"{self._path} has not been walked through yet.")
        return self._walk

    def forward(self) -> Iterator[Frame]:
        """All frames, in order; may be asked for again, which opens the video anew.

        Raises
        ------
        VideoError
            As `FrameSource` does; also when a later walk gives other frames than the first.
        """
        times_ns: list[int] = []
        findings_at: dict[int, tuple[Finding, ...]] = {}
        with self._take_source() as source, reading_ahead(source, self._threads) as frames:
            for frame in frames:
                times_ns.append(frame.pts_ns)
                if frame.findings:
                    findings_at[frame.index] = frame.findings
                yield frame
            walk = ForwardWalk(source.info, tuple(times_ns), source.findings, findings_at)
        if self._walk is None:
            self._walk = walk
        elif walk.times_ns != self._walk.times_ns:
            raise VideoError(
                f"{self._path}: reading it again gave {len(walk.times_ns)} frames where there "
                f"were {len(self._walk.times_ns)}, or other times; do not change a video while it "
                "is annotated."
            )

    def backward(self, start: int, stop: int) -> Iterator[Frame]:
        """The frames ``stop - 1``, ``stop - 2``, … down to `start`; see `Rewinder.walk`."""
        if self._rewinder is None:
            self._rewinder = Rewinder(
                self._path, self.info, self.walk.times_ns, budget_bytes=self._budget_bytes
            )
        return self._rewinder.walk(start, stop)

    def close(self) -> None:
        """Free the file."""
        if self._fresh is not None:
            self._fresh.close()
        if self._rewinder is not None:
            self._rewinder.close()
        self._fresh = self._rewinder = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _open(self) -> FrameSource:
        return open_video(self._path, incomplete=self._incomplete, limits=self._limits)

    def _take_source(self) -> FrameSource:
        """The source that is open and unread, or a new one."""
        source, self._fresh = self._fresh or self._open(), None
        return source
