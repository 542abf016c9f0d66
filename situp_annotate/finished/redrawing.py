"""Draw the overlays of a finished run once more."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from situp_annotate.errors import SitupError
from situp_annotate.finished.replaying import labelled_frames, labels_of
from situp_annotate.formats.labelled import LabelledVideo
from situp_annotate.formats.overlay.beside import BesideSink, Side
from situp_annotate.formats.overlay.options import OverlayOptions
from situp_annotate.formats.overlay.sink import OverlaySink
from situp_annotate.formats.overlay.stretches import doubtful_stretches
from situp_annotate.types import Track

__all__ = ["redraw", "redraw_beside"]

OnFrame = Callable[[], None]


def _tracks(video: LabelledVideo) -> tuple[Track, ...]:
    return tuple(labelled.track for labelled in video.tracks)


def redraw(
    video: LabelledVideo,
    path: Path,
    options: OverlayOptions,
    *,
    threads: int = 1,
    on_frame: OnFrame = lambda: None,
) -> None:
    """Write the overlay of a video.

    Parameters
    ----------
    video : LabelledVideo
        What a run has found.
    path : Path
        File to write.
    options : OverlayOptions
        What to show, and how to encode it.
    threads : int
        With more than one, decoding, drawing and encoding overlap; the file is the same.
    on_frame : callable
        Called after each frame of the video.

    Raises
    ------
    VideoError
        As `labelled_frames` does.
    OutputError, OSError
        As `H264Writer` does.
    """
    tracks = _tracks(video)
    sink = OverlaySink(
        path,
        info=video.info,
        tracks=tracks,
        options=options,
        stretches=doubtful_stretches(labels_of(video), tracks, video.info, options),
        background=threads > 1,
    )
    with sink, closing(labelled_frames(video, threads=threads)) as frames:
        for frame, points in frames:
            sink.write(frame, points)
            on_frame()


def redraw_beside(
    left: tuple[str, LabelledVideo],
    right: tuple[str, LabelledVideo],
    path: Path,
    options: OverlayOptions,
    *,
    threads: int = 1,
    on_frame: OnFrame = lambda: None,
) -> None:
    """Write what two runs have found in a video, beside each other.

    Parameters
    ----------
    left, right : tuple of (str, LabelledVideo)
        Name of a run, and what it has found in the video.
    path, options, threads, on_frame
        As of `redraw`; of what is below a confidence, shows what is doubtful in either run.

    Raises
    ------
    SitupError
        If the runs have not annotated the same video.
    VideoError, OutputError, OSError
        As `redraw` does.
    """
    (_, video), (_, other) = left, right
    _check_same(video, other)
    sides = (Side(left[0], _tracks(video)), Side(right[0], _tracks(other)))
    joined = (a + b for a, b in zip(labels_of(video), labels_of(other), strict=True))
    tracks = sides[0].tracks + sides[1].tracks
    sink = BesideSink(
        path,
        info=video.info,
        sides=sides,
        options=options,
        stretches=doubtful_stretches(joined, tracks, video.info, options),
        background=threads > 1,
    )
    with sink, closing(labelled_frames(video, threads=threads)) as frames:
        for (frame, points), other_points in zip(frames, labels_of(other), strict=True):
            sink.write(frame, points, other_points)
            on_frame()


def _check_same(left: LabelledVideo, right: LabelledVideo) -> None:
    shapes = [(v.info.width, v.info.height, v.frame_count) for v in (left, right)]
    if shapes[0] != shapes[1]:
        texts = [f"{count} frames of {width} × {height} pixels" for width, height, count in shapes]
        raise SitupError(
            f"{left.id}: the two runs have not annotated the same video, but one has "
            f"{texts[0]} and the other {texts[1]}."
        )
