"""Which frames an overlay shows, if not all, and when."""

from collections.abc import Iterable, Sequence

from situp_annotate.formats.overlay.options import OverlayOptions
from situp_annotate.types import NS_PER_S, Frame, Track, TrackPoint, VideoInfo

__all__ = ["Excerpt", "doubtful_stretches"]


def doubtful_stretches(
    labels: Iterable[Sequence[TrackPoint]],
    tracks: Sequence[Track],
    info: VideoInfo,
    options: OverlayOptions,
) -> tuple[range, ...] | None:
    """Find the frames that show what is not certain.

    Parameters
    ----------
    labels : iterable of sequence of TrackPoint
        Of every frame of the video, in order.
    tracks : sequence of Track
        Of the video.
    info : VideoInfo
        What is known of the video.
    options : OverlayOptions
        Which tracks are shown, below which confidence, and with how much around it.

    Returns
    -------
    tuple of range, or None
        Stretches of frames, in order and apart; None if the whole video is to be shown.
    """
    if not options.below:
        return None
    shown = {track.id for track in options.shown(tracks)}
    around = round(options.context * info.frame_rate)
    stretches: list[range] = []
    count = 0
    for frame, points in enumerate(labels):
        count += 1
        if any(p.track_id in shown and p.confidence < options.below for p in points):
            start, stop = max(frame - around, 0), frame + around + 1
            if stretches and start <= stretches[-1].stop:
                start = stretches.pop().start
            stretches.append(range(start, stop))
    return tuple(range(each.start, min(each.stop, count)) for each in stretches)


class Excerpt:
    """The frames of some stretches of a video, one stretch right after the other.

    Parameters
    ----------
    stretches : sequence of range
        Frames to show, in order and apart.
    info : VideoInfo
        What is known of the video.
    """

    def __init__(self, stretches: Sequence[range], info: VideoInfo) -> None:
        self._stretches = iter(stretches)
        self._current = next(self._stretches, range(0))
        self._usual_step_ns = round(NS_PER_S / info.frame_rate)
        self._cut_ns = 0
        self._next_ns = 0

    def time_of(self, frame: Frame) -> int | None:
        """When a frame is shown, in nanoseconds; None if it is not. Frames come in order."""
        while self._current and frame.index >= self._current.stop:
            self._current = next(self._stretches, range(0))
        if frame.index not in self._current:
            return None
        if frame.index == self._current.start:
            self._cut_ns = frame.pts_ns - self._next_ns
        time_ns = frame.pts_ns - self._cut_ns
        self._next_ns = time_ns + self._usual_step_ns
        return time_ns
