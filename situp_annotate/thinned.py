"""From the outputs of a run back to a manifest: each track with the fewest keyframes.

The keyframes of a thinned track are interpolated between, not tracked from. They are few enough
to be looked through and corrected by hand, and they give the labels of the run back.
"""

import json
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from situp_annotate.errors import SitupError
from situp_annotate.formats.mot import read_mot
from situp_annotate.propagation.thinning import overlaps, thin
from situp_annotate.types import BoundingBox, Extend, Keyframe, Method, Track, VideoJob

__all__ = ["ThinnedVideo", "thin_video"]

_MOT = "mot.csv"
_SUMMARY = "summary.json"

_DECIMALS = 3
"""Of the numbers in ``mot.csv``, which are the numbers of the new manifest."""

_ROUNDING = 0.5 * 10**-_DECIMALS
"""In pixels: what the interpolated boxes are off by when they stand in a ``mot.csv`` again."""

_Boxes: TypeAlias = dict[int, BoundingBox]
"""The box of each frame of a track, by the index of the frame."""


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


@dataclass(frozen=True, slots=True)
class _Run:
    """What ``summary.json`` says of how a video was annotated.

    Attributes
    ----------
    frames : int
        Of the video, as decoded.
    width, height : int
        Of the picture, in pixels.
    pixel_origin : int
        Of ``mot.csv``.
    unused : frozenset of tuple of int
        Track and frame of each keyframe that the run could not use.
    """

    frames: int
    width: int
    height: int
    pixel_origin: int
    unused: frozenset[tuple[int, int]]


def _read_summary(path: Path) -> _Run:
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
        return _Run(
            frames=int(summary["frames"]),
            width=int(summary["video"]["width"]),
            height=int(summary["video"]["height"]),
            pixel_origin=int(summary["recipe"]["mot"]["pixel_origin"]),
            unused=frozenset((skip["track_id"], skip["frame"]) for skip in summary["skipped"]),
        )
    except OSError as error:
        raise SitupError(f"{path}: cannot be read: {error.strerror or error}.") from error
    except (ValueError, KeyError, TypeError) as error:
        raise SitupError(
            f"{path}: this is not what `situp-annotate run` writes; annotate the video again."
        ) from error


def _read_boxes(path: Path, run: _Run) -> Mapping[int, _Boxes]:
    """Boxes by track and frame, as far as any of the box lies inside the picture."""
    if not path.exists():
        raise SitupError(
            f"{path}: there is no such file; annotate the video again with a recipe that writes "
            f"it, outputs.mot=true."
        )
    tracks: defaultdict[int, _Boxes] = defaultdict(dict)
    for row in read_mot(path, pixel_origin=run.pixel_origin):
        numbers = (row.box.x, row.box.y, row.box.width, row.box.height)
        # Taking the origin away leaves 10.123 as 10.123000000000001.
        box = BoundingBox(*(round(number, _DECIMALS) for number in numbers))
        # A tracker can drift out of the picture, but a keyframe there is refused.
        if box.intersects(run.width, run.height):
            tracks[row.track_id][row.frame] = box
    return tracks


def _agree(box: BoundingBox, written: BoundingBox) -> bool:
    ours = (box.x, box.y, box.width, box.height)
    theirs = (written.x, written.y, written.width, written.height)
    # Half a unit of the last decimal would do, were it not for widths below it.
    return all(abs(a - b) <= 2 * _ROUNDING for a, b in zip(ours, theirs, strict=True))


def _human_keyframes(track: Track, boxes: _Boxes, run: _Run, path: Path) -> dict[int, Keyframe]:
    """Those keyframes with a box that the run used, by frame."""
    used = {}
    for keyframe in track.keyframes:
        if keyframe.box is None or (track.id, keyframe.frame) in run.unused:
            continue
        written = boxes.get(keyframe.frame)
        if written is None or not _agree(keyframe.box, written):
            raise SitupError(
                f"{path}: track {track.id} has another box, or none, where the manifest has a "
                f"keyframe, at frame {keyframe.frame}; give the manifest of the run, or annotate "
                f"the video again."
            )
        used[keyframe.frame] = keyframe
    return used


def _keyframes(
    kept: _Boxes, boxes: _Boxes, human: Mapping[int, Keyframe], frame_count: int
) -> tuple[Keyframe, ...]:
    """Keyframes at the kept boxes, hidden as the human ones say, and where the object leaves."""
    keyframes = []
    occluded = False
    for frame, box in kept.items():
        if frame in human:
            occluded = human[frame].occluded
        keyframes.append(Keyframe(frame, box, occluded))
        if frame + 1 not in boxes and frame + 1 < frame_count:
            keyframes.append(Keyframe(frame + 1, None))
    return tuple(keyframes)


def _thin_track(
    track: Track, boxes: _Boxes, human: Mapping[int, Keyframe], frame_count: int, iou: float
) -> tuple[Track, npt.NDArray[np.float64]]:
    """The thinned track, and how much each box is overlapped by what it gives."""
    drawn = {frame: keyframe.box for frame, keyframe in human.items() if keyframe.box}
    boxes = boxes | drawn
    kept = thin(boxes, iou=iou, keep=drawn, rounding=_ROUNDING)
    thinned = replace(
        track,
        keyframes=_keyframes(kept, boxes, human, frame_count),
        method=Method.LINEAR,
        extend=Extend.FORWARD,  # the keyframes begin where the boxes do
    )
    return thinned, overlaps(boxes, kept)


def thin_video(job: VideoJob, output: Path, *, iou: float = 0.9) -> ThinnedVideo:
    """Thin the tracks of one video that a run has annotated.

    Parameters
    ----------
    job : VideoJob
        The video, with the keyframes that the run was given.
    output : Path
        The run's output folder; ``mot.csv`` and ``summary.json`` in its folder ``job.id`` are
        read.
    iou : float
        In (0, 1]: what interpolation overlaps each box of the run by, at least, as intersection
        over union; in spite of rounding, so that it holds for the ``mot.csv`` of the new tracks.

    Returns
    -------
    ThinnedVideo
        The job with tracks that have as few keyframes as can be, those of the person among them
        with their own boxes, and ``outside`` wherever boxes end before the video does. Boxes
        that lie wholly outside the picture are left out. Tracks without a box stay as they are.

    Raises
    ------
    SitupError
        If a file is missing or not a run's, or the run was given other tracks.
    """
    folder = output / job.id
    if not folder.is_dir():
        raise SitupError(f"{folder}: there is no such folder; annotate the video first.")
    run = _read_summary(folder / _SUMMARY)
    path = folder / _MOT
    labelled = _read_boxes(path, run)
    if unknown := labelled.keys() - {track.id for track in job.tracks}:
        raise SitupError(
            f"{path}: there is a track {min(unknown)}, which the manifest does not have; give "
            f"the manifest of the run."
        )
    pairs = []
    for track in job.tracks:
        boxes = labelled.get(track.id, {})
        human = _human_keyframes(track, boxes, run, path)
        if boxes:
            pairs.append(_thin_track(track, boxes, human, run.frames, iou))
        else:
            pairs.append((track, np.empty(0)))
    overlap = np.concatenate([np.empty(0), *(scores for _, scores in pairs)])
    return ThinnedVideo(
        job=replace(job, tracks=tuple(track for track, _ in pairs)),
        boxes=overlap.size,
        keyframes=sum(
            keyframe.box is not None
            for track, scores in pairs
            if scores.size
            for keyframe in track.keyframes
        ),
        mean_overlap=float(overlap.mean()) if overlap.size else None,
        least_overlap=float(overlap.min()) if overlap.size else None,
    )
