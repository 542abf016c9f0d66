"""Go through a video once more with the labels of a finished run: nothing is tracked."""

from collections.abc import Generator, Iterator

from situp_annotate.errors import VideoError
from situp_annotate.formats.labelled import LabelledVideo
from situp_annotate.types import NS_PER_S, Frame, TrackPoint
from situp_annotate.video import open_video
from situp_annotate.video.prefetch import reading_ahead

__all__ = ["labelled_frames", "labels_of"]

_TOLERANCE_NS = 1_000_000
"""How much the time of a frame may differ: another decoder may round it otherwise."""


def labels_of(video: LabelledVideo) -> Iterator[tuple[TrackPoint, ...]]:
    """The labels of each frame in turn, by track id."""
    for frame in range(video.frame_count):
        yield tuple(track.points[frame] for track in video.tracks if frame in track.points)


def labelled_frames(
    video: LabelledVideo, *, threads: int = 1
) -> Generator[tuple[Frame, tuple[TrackPoint, ...]]]:
    """Read a video that a run has annotated, with its labels.

    Parameters
    ----------
    video : LabelledVideo
        What the run has found.
    threads : int
        With more than one, decodes ahead. Close this generator to stop early.

    Yields
    ------
    tuple of (Frame, tuple of TrackPoint)
        Every frame that the run has seen, and its labels by track id.

    Raises
    ------
    VideoError
        If the video cannot be read, or is not the one that was annotated.
    """
    path = video.info.path
    with (
        open_video(path, incomplete="keep") as source,
        reading_ahead(source, threads) as frames,
    ):
        for index, points in enumerate(labels_of(video)):
            frame = next(frames, None)
            if frame is None:
                raise VideoError(
                    f"{path}: this is not the video that was annotated: it has {index} frames, "
                    f"not {video.frame_count}; put the right one there, or annotate this one."
                )
            then_ns = video.times_ns.get(index, frame.pts_ns)
            if abs(then_ns - frame.pts_ns) > _TOLERANCE_NS:
                raise VideoError(
                    f"{path}: this is not the video that was annotated: frame {index} is at "
                    f"{frame.pts_ns / NS_PER_S:.3f} s, not at {then_ns / NS_PER_S:.3f} s; put the "
                    "right one there, or annotate this one."
                )
            yield frame, points
