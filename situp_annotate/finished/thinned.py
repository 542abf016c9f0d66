"""From the outputs of a run back to a manifest: each track with the fewest keyframes.

The keyframes of a thinned track are interpolated between, not tracked from. They are few enough
to be looked through and corrected by hand, and they give the labels of the run back.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from situp_annotate.errors import SitupError
from situp_annotate.formats.keyframed import keyframes_of
from situp_annotate.formats.labelled import LabelledTrack, LabelledVideo
from situp_annotate.propagation.thinning import overlaps
from situp_annotate.results import read_video
from situp_annotate.types import BoundingBox, Extend, Keyframe, Method, State, Track, VideoJob

__all__ = ["ThinnedVideo", "thin_video"]

_DECIMALS = 3
"""Of the numbers in the new manifest, and in the ``mot.csv`` that is made from it."""

_STATES = (State.VISIBLE, State.OCCLUDED)
"""Where the object is lost, its box says nothing about where it is."""


@dataclass(frozen=True, slots=True)
class ThinnedVideo:
    """One video with thinned tracks, and how well they stand for what was labelled.

    Attributes
    ----------
    job : VideoJob
        The video and its thinned tracks.
    boxes : int
        Labelled by the run, of all tracks.
    keyframes : int
        With a box, of all tracks.
    mean_overlap, least_overlap : float or None
        Intersection over union, in [0, 1], of the boxes and what is interpolated in their place;
        None without boxes.
    """

    job: VideoJob
    boxes: int
    keyframes: int
    mean_overlap: float | None = None
    least_overlap: float | None = None


def _rounded(box: BoundingBox) -> BoundingBox:
    return BoundingBox(*(round(n, _DECIMALS) for n in (box.x, box.y, box.width, box.height)))


def _labels_to_keep(labelled: LabelledTrack, video: LabelledVideo) -> LabelledTrack:
    """What has a box that a manifest may hold: a tracker can drift out of the picture."""
    size = (video.info.width, video.info.height)
    points = {
        frame: point
        for frame, point in labelled.in_states(_STATES).items()
        if point.box.intersects(*size)
    }
    return LabelledTrack(labelled.track, points)


def _thin_track(
    labelled: LabelledTrack, video: LabelledVideo, iou: float
) -> tuple[Track, npt.NDArray[np.float64]]:
    """The thinned track, and how much each box is overlapped by what it gives."""
    kept = _labels_to_keep(labelled, video)
    found = keyframes_of(
        kept, frame_count=video.frame_count, iou=iou, states=_STATES, decimals=_DECIMALS
    )
    if not found:
        return labelled.track, np.empty(0)
    drawn = {keyframe.frame for keyframe in labelled.track.keyframes}
    keyframes = tuple(
        replace(each, box=_rounded(each.box)) if each.box and each.frame not in drawn else each
        for each in found
    )
    thinned = replace(
        labelled.track,
        keyframes=keyframes,
        method=Method.LINEAR,
        extend=Extend.FORWARD,  # the keyframes begin where the boxes do
    )
    boxes = {frame: point.box for frame, point in kept.points.items()}
    return thinned, overlaps(boxes, {k.frame: k.box for k in keyframes if k.box})


def _check_origin(job: VideoJob, video: LabelledVideo, folder: Path) -> None:
    """The run must have been given what the manifest says, or corrections would be lost."""
    ours: dict[int, tuple[Keyframe, ...]] = {track.id: track.keyframes for track in job.tracks}
    theirs = {labelled.track.id: labelled.track.keyframes for labelled in video.tracks}
    differing = [id_ for id_ in ours | theirs if ours.get(id_) != theirs.get(id_)]
    if differing:
        raise SitupError(
            f"{folder}: this run was given other keyframes for track {min(differing)} than the "
            "manifest has; give the manifest of the run, or annotate the video again."
        )


def thin_video(job: VideoJob, output: Path, *, iou: float = 0.9) -> ThinnedVideo:
    """Thin the tracks of one video that a run has annotated.

    Parameters
    ----------
    job : VideoJob
        The video, with the keyframes that the run was given.
    output : Path
        The run's output folder; its folder ``job.id`` is read.
    iou : float
        In (0, 1]: what interpolation overlaps each box of the run by, at least, as intersection
        over union; in spite of rounding, so that it holds for the ``mot.csv`` of the new tracks.

    Returns
    -------
    ThinnedVideo
        The job with tracks that have as few keyframes as can be, those of the person among them
        with their own boxes, and ``outside`` wherever boxes end before the video does. Lost
        boxes and those that lie wholly outside the picture are left out. Tracks without a box
        stay as they are.

    Raises
    ------
    SitupError
        If a file is missing or not a run's, or the run was given other tracks.
    """
    folder = output / job.id
    if not folder.is_dir():
        raise SitupError(f"{folder}: there is no such folder; annotate the video first.")
    video = read_video(folder)
    _check_origin(job, video, folder)
    pairs = {labelled.track.id: _thin_track(labelled, video, iou) for labelled in video.tracks}
    overlap = np.concatenate([np.empty(0), *(scores for _, scores in pairs.values())])
    return ThinnedVideo(
        job=replace(job, tracks=tuple(pairs[track.id][0] for track in job.tracks)),
        boxes=overlap.size,
        keyframes=sum(
            keyframe.box is not None
            for track, scores in pairs.values()
            if scores.size
            for keyframe in track.keyframes
        ),
        mean_overlap=float(overlap.mean()) if overlap.size else None,
        least_overlap=float(overlap.min()) if overlap.size else None,
    )
