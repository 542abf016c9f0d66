"""From labels that were exported, corrected elsewhere and imported again: what a person changed.

A tool such as CVAT gives back every keyframe that it was sent, its person's corrections among
them, and says of none where it comes from. The labels of the run do: a box that is still where
the run had put it is the run's own, and is left to be found again; all others are a person's.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from situp_annotate.formats.cvat.attributes import text_at
from situp_annotate.formats.labelled import LabelledTrack, LabelledVideo
from situp_annotate.types import BoundingBox, Keyframe, State, Track, TrackPoint

__all__ = ["Corrected", "correct"]

_SAME = 0.02
"""Pixels by which a box may be off and still be the same: formats round to a hundredth."""


@dataclass(frozen=True, slots=True)
class Corrected:
    """What a person made of the labels of a video.

    Attributes
    ----------
    tracks : tuple of Track
        What a person has drawn by now, for the next run.
    changed, added, removed : int
        Keyframes with another box or state, tracks that are new, and tracks that are gone.
    """

    tracks: tuple[Track, ...]
    changed: int
    added: int
    removed: int


def _edges(box: BoundingBox, size_wh: tuple[int, int] | None = None) -> np.ndarray:
    edges = np.array([box.x, box.y, box.right, box.bottom])
    return edges if size_wh is None else np.clip(edges, 0, [*size_wh, *size_wh])


def _is_same(box: BoundingBox, other: BoundingBox, size_wh: tuple[int, int]) -> bool:
    """Whether a box is the other one, or as much of it as lies in the picture."""
    edges = _edges(box)
    return any(
        bool(np.abs(edges - theirs).max() <= _SAME)
        for theirs in (_edges(other), _edges(other, size_wh))
    )


def _is_own(keyframe: Keyframe, point: TrackPoint | None, size_wh: tuple[int, int]) -> bool:
    """Whether the run said the same of this frame."""
    if point is None or point.state is State.LOST:
        return keyframe.box is None
    hidden = point.state is State.OCCLUDED
    return (
        keyframe.box is not None
        and keyframe.occluded == hidden
        and _is_same(keyframe.box, point.box, size_wh)
    )


def _match(
    tracks: Sequence[Track], labelled: Sequence[LabelledTrack], size_wh: tuple[int, int]
) -> dict[int, LabelledTrack]:
    """The run's track for each imported one, by its place: most boxes in common, label, id."""
    likeness = np.zeros((len(tracks), len(labelled)))
    for row, track in enumerate(tracks):
        for column, theirs in enumerate(labelled):
            shared = sum(
                keyframe.box is not None
                and _is_own(keyframe, theirs.points.get(keyframe.frame), size_wh)
                for keyframe in track.keyframes
            )
            same_object = (track.id, track.label) == (theirs.track.id, theirs.track.label)
            likeness[row, column] = shared + 0.5 * same_object
    rows, columns = linear_sum_assignment(likeness, maximize=True)
    return {
        int(row): labelled[column]
        for row, column in zip(rows, columns, strict=True)
        if likeness[row, column] > 0
    }


def _drawn(
    keyframes: Sequence[Keyframe], labelled: LabelledTrack, size_wh: tuple[int, int]
) -> Iterator[tuple[Keyframe, bool]]:
    """The keyframes that are a person's, and whether they differ from what the run had."""
    before = {keyframe.frame: keyframe for keyframe in labelled.track.keyframes}
    ends_a_change = False
    for keyframe in keyframes:
        point, old = labelled.points.get(keyframe.frame), before.get(keyframe.frame)
        own = _is_own(keyframe, point, size_wh)
        if own and old is not None and (old.box is None) == (keyframe.box is None):
            yield old, False
        elif not own:
            yield keyframe, True
        elif ends_a_change:  # what was changed before this keyframe ends at it
            yield keyframe, False
        ends_a_change = not own and (keyframe.occluded or keyframe.box is None)


def _still_outside(keyframes: Sequence[Keyframe], labelled: LabelledTrack) -> Iterator[Keyframe]:
    """Where a person had said that the object leaves, and it has been gone before already."""
    frames = {keyframe.frame for keyframe in keyframes}
    for old in labelled.track.keyframes:
        if old.box is None and old.frame not in frames:
            earlier = [keyframe for keyframe in keyframes if keyframe.frame < old.frame]
            if earlier and earlier[-1].box is None:
                yield old


def _from_first_box(keyframes: Sequence[Keyframe]) -> tuple[Keyframe, ...]:
    """Without what says that the object is outside before it was ever seen."""
    first = next((n for n, keyframe in enumerate(keyframes) if keyframe.box), len(keyframes))
    return tuple(keyframes[first:])


def _attributes(old: dict[str, Any], new: dict[str, Any]) -> dict[str, Any]:
    """The run's attributes with what was changed; many tools hold nothing but text."""
    same = {name for name in new if name in old and new[name] == text_at(old[name], 0)}
    return {**old, **{name: value for name, value in new.items() if name not in same}}


def _correct_track(
    track: Track, labelled: LabelledTrack, size_wh: tuple[int, int]
) -> tuple[Track, int]:
    """The run's track with the keyframes that are a person's by now, and how many are new."""
    found = list(_drawn(track.keyframes, labelled, size_wh))
    kept = [keyframe for keyframe, _ in found] + list(_still_outside(track.keyframes, labelled))
    keyframes = _from_first_box(sorted(kept, key=lambda keyframe: keyframe.frame))
    attributes = _attributes(labelled.track.attributes, track.attributes)
    corrected = replace(
        labelled.track, label=track.label, attributes=attributes, keyframes=keyframes
    )
    return corrected, sum(changed for _, changed in found)


def correct(tracks: Sequence[Track], video: LabelledVideo) -> Corrected:
    """Tell a person's corrections from the labels that a run had found.

    Parameters
    ----------
    tracks : sequence of Track
        As imported; ids need not be those of the run.
    video : LabelledVideo
        What the run had found.

    Returns
    -------
    Corrected
        Each track has its keyframes of the run as far as they are still there, and those that a
        person has changed or added; its id, method and extent are the run's. A changed keyframe
        that hides the object, or says that it is outside, is followed by the next imported one,
        which ends that. Tracks without a box left are gone; new ones get ids of their own.
    """
    size_wh = (video.info.width, video.info.height)
    matches = _match(tracks, video.tracks, size_wh)
    ids = {labelled.track.id for labelled in video.tracks}
    result, changed, added = [], 0, 0
    for place, track in enumerate(tracks):
        if place in matches:
            corrected, count = _correct_track(track, matches[place], size_wh)
            changed += count
            if corrected.keyframes:
                result.append(corrected)
        else:
            added += 1
            new_id = track.id if track.id not in ids else max(ids) + 1
            ids.add(new_id)
            result.append(replace(track, id=new_id))
    kept = {track.id for track in result}
    removed = sum(labelled.track.id not in kept for labelled in video.tracks if labelled.points)
    ordered = sorted(result, key=lambda track: track.id)
    return Corrected(tuple(ordered), changed, added, removed)
