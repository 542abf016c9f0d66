"""A short excerpt of a finished run as an animated picture."""

from collections.abc import Callable
from contextlib import closing
from dataclasses import replace

from situp_annotate.errors import SitupError
from situp_annotate.finished.replaying import labelled_frames
from situp_annotate.formats.labelled import LabelledVideo
from situp_annotate.formats.overlay.animation import AnimationFormat, encode_animation
from situp_annotate.formats.overlay.options import OverlayOptions
from situp_annotate.formats.overlay.painter import Painter
from situp_annotate.types import NS_PER_S

__all__ = ["make_excerpt"]

_MOST_BYTES = 2**30
"""Of pictures, which are all in memory at once."""


def make_excerpt(
    video: LabelledVideo,
    options: OverlayOptions,
    *,
    form: AnimationFormat,
    start_s: float,
    seconds: float,
    width: int = 480,
    frame_rate: float = 10.0,
    on_frame: Callable[[], None] = lambda: None,
) -> bytes:
    """Make an animated picture of a part of an overlay.

    Parameters
    ----------
    video : LabelledVideo
        What a run has found.
    options : OverlayOptions
        What to show; how overlays are encoded does not matter.
    form : {"gif", "webp"}
        File format.
    start_s, seconds : float
        From when on, and how long; cut off at the end of the video.
    width : int
        In pixels; smaller pictures are left as they are.
    frame_rate : float
        Pictures a second, at most.
    on_frame : callable
        Called after each frame that is read.

    Returns
    -------
    bytes
        The file's content.

    Raises
    ------
    SitupError
        If the video ends before the excerpt begins, or the excerpt would be huge.
    VideoError
        As `labelled_frames` does.
    """
    info = video.info
    height = max(round(info.height * min(width / info.width, 1)), 1)
    painter = Painter(
        [labelled.track for labelled in video.tracks],
        (info.height, info.width),
        replace(options, max_height=max(height, 16)),
    )
    _refuse_huge(painter.size_hw, seconds * min(frame_rate, float(info.frame_rate)))
    start_ns, step_ns = round(start_s * NS_PER_S), round(NS_PER_S / frame_rate)
    stop_ns = start_ns + round(seconds * NS_PER_S)
    images, times_ns = [], []
    due_ns = end_ns = start_ns
    with closing(labelled_frames(video)) as frames:
        for frame, points in frames:
            end_ns = min(frame.pts_ns + round(NS_PER_S / info.frame_rate), stop_ns)
            if frame.pts_ns >= stop_ns:
                break
            if frame.pts_ns < due_ns:
                painter.note(frame, points)
            else:
                images.append(painter.paint(frame, points))
                times_ns.append(frame.pts_ns)
                due_ns += step_ns * (1 + (frame.pts_ns - due_ns) // step_ns)
            on_frame()
    if not images:
        raise SitupError(
            f"{info.path}: the video ends after {end_ns / NS_PER_S:.2f} s, before the excerpt "
            f"begins at {start_s:g} s; begin earlier."
        )
    return encode_animation(images, [*times_ns, max(end_ns, times_ns[-1] + step_ns)], form)


def _refuse_huge(size_hw: tuple[int, int], count: float) -> None:
    height, width = size_hw
    if height * width * 3 * count > _MOST_BYTES:
        raise SitupError(
            f"An excerpt of {count:.0f} pictures of {width} × {height} pixels would be huge; make "
            "it shorter, narrower, or of fewer pictures a second."
        )
