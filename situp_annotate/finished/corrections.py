"""From labels that were exported, corrected elsewhere and imported again: what a person changed.

A tool such as CVAT gives back every keyframe that it was sent, its person's corrections among
them, and says of none where it comes from. The labels of the run do: a box that is still where
the run had put it is the run's own, and is left to be found again; all others are a person's.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from situp_annotate.finished.agreement import Found
from situp_annotate.formats.cvat.attributes import text_at
from situp_annotate.formats.labelled import LabelledTrack, LabelledVideo
from situp_annotate.types import Extend, Keyframe, Track

__all__ = ["Corrected", "correct"]


@dataclass(frozen=True, slots=True)
class Corrected:
    """What a person made of the labels of a video.

    Attributes
    ----------
    tracks : tuple of Track
        What a person has drawn by now, for the next run.
    changed, added, removed : int
        Keyframes that the run did not have, tracks that are new, and tracks that are gone.
    """

    tracks: tuple[Track, ...]
    changed: int
    added: int
    removed: int


def _match(tracks: Sequence[Track], video: LabelledVideo, found: Sequence[Found]) -> dict[int, int]:
    """Place of the run's track for that of each imported one: most boxes in common, label, id."""
    likeness = np.zeros((len(tracks), len(found)))
    for row, track in enumerate(tracks):
        for column, (labelled, theirs) in enumerate(zip(video.tracks, found, strict=True)):
            same_object = (track.id, track.label) == (labelled.track.id, labelled.track.label)
            likeness[row, column] = theirs.boxes_in_common(track.keyframes) + 0.5 * same_object
    rows, columns = linear_sum_assignment(likeness, maximize=True)
    return {
        int(row): int(column)
        for row, column in zip(rows, columns, strict=True)
        if likeness[row, column] > 0
    }


def _deletions(keyframes: Sequence[Keyframe], own: Sequence[bool], found: Found) -> set[int]:
    """Places of the keyframes beside a stretch that the run's own keyframes do not stand for.

    Something between them is gone. Beside a keyframe that is a person's nothing else is expected.
    """
    places: set[int] = set()
    for place, (before, after) in enumerate(pairwise([*keyframes, None])):
        ours = own[place] and (after is None or own[place + 1])
        if ours and before is not None and not found.agrees_between(before, after):
            places |= {place} if after is None else {place, place + 1}
    return places


def _starts_anew(keyframes: Sequence[Keyframe], labelled: LabelledTrack) -> bool:
    """Whether the first box that a person had drawn is gone."""
    first = next((keyframe.frame for keyframe in labelled.track.keyframes if keyframe.box), None)
    return first not in {keyframe.frame for keyframe in keyframes if keyframe.box}


def _is_over(kept: Keyframe | None, keyframe: Keyframe) -> bool:
    """Whether a keyframe ends what a person said before it: that the object is hidden, or away."""
    if kept is None or (kept.box is not None and not kept.occluded):
        return False
    return (keyframe.box is None, keyframe.occluded) != (kept.box is None, kept.occluded)


def _drawn(
    keyframes: Sequence[Keyframe], labelled: LabelledTrack, found: Found
) -> tuple[list[Keyframe], int]:
    """The keyframes that are a person's by now, and how many of them the run did not have."""
    old = {keyframe.frame: keyframe for keyframe in labelled.track.keyframes}
    own = [found.has(keyframe) for keyframe in keyframes]
    needed = _deletions(keyframes, own, found)
    if _starts_anew(keyframes, labelled) or found.starts_before(keyframes):
        needed |= {place for place, keyframe in enumerate(keyframes) if keyframe.box and not place}
    kept: list[Keyframe] = []
    changed = 0
    for place, keyframe in enumerate(keyframes):
        drawn = old.get(keyframe.frame)
        if own[place] and drawn is not None and (drawn.box is None) == (keyframe.box is None):
            kept.append(drawn)
        elif not own[place] or place in needed:
            kept.append(keyframe)
            changed += 1
        elif _is_over(kept[-1] if kept else None, keyframe):
            kept.append(keyframe)
    return kept, changed


def _still_outside(keyframes: Sequence[Keyframe], labelled: LabelledTrack) -> list[Keyframe]:
    """Where a person had said that the object leaves, and it has been gone before already."""
    frames = {keyframe.frame for keyframe in keyframes}
    still = []
    for old in labelled.track.keyframes:
        if old.box is None and old.frame not in frames:
            earlier = [keyframe for keyframe in keyframes if keyframe.frame < old.frame]
            if earlier and earlier[-1].box is None:
                still.append(old)
    return still


def _from_first_box(keyframes: Sequence[Keyframe]) -> tuple[Keyframe, ...]:
    """Without what says that the object is outside before it was ever seen."""
    first = next((n for n, keyframe in enumerate(keyframes) if keyframe.box), len(keyframes))
    return tuple(keyframes[first:])


def _attributes(old: dict[str, Any], new: dict[str, Any]) -> dict[str, Any]:
    """The run's attributes with what was changed; many tools hold nothing but text."""
    same = {name for name in new if name in old and new[name] == text_at(old[name], 0)}
    return {**old, **{name: value for name, value in new.items() if name not in same}}


def _correct_track(track: Track, labelled: LabelledTrack, found: Found) -> tuple[Track, int]:
    """The run's track with the keyframes that are a person's by now, and how many are new."""
    imported = _from_first_box(track.keyframes)
    kept, changed = _drawn(imported, labelled, found)
    kept += _still_outside(imported, labelled)
    corrected = replace(
        labelled.track,
        label=track.label,
        attributes=_attributes(labelled.track.attributes, track.attributes),
        keyframes=_from_first_box(sorted(kept, key=lambda keyframe: keyframe.frame)),
        extend=Extend.FORWARD if found.starts_before(imported) else labelled.track.extend,
    )
    return corrected, changed


def correct(tracks: Sequence[Track], video: LabelledVideo, *, iou: float = 0.9) -> Corrected:
    """Tell a person's corrections from the labels that a run had found.

    Parameters
    ----------
    tracks : sequence of Track
        As imported; ids need not be those of the run.
    video : LabelledVideo
        What the run had found.
    iou : float
        What the export was thinned by, as of `ExportOptions`.

    Returns
    -------
    Corrected
        Each track has its keyframes of the run as far as they are still there, and those that a
        person has changed or added. Of the run's own keyframes those are kept, too, that stand
        beside a deleted one, begin a track whose first box is gone, or end what a person said;
        all others are left to be found again. Ids and methods are the run's. Tracks without a
        box left are gone; new ones get ids of their own.
    """
    found = [Found.of(labelled, video, iou) for labelled in video.tracks]
    matches = _match(tracks, video, found)
    ids = {labelled.track.id for labelled in video.tracks}
    result: list[Track] = []
    changed = added = 0
    for place, track in enumerate(tracks):
        if place in matches:
            match = matches[place]
            corrected, count = _correct_track(track, video.tracks[match], found[match])
            changed += count
            result += [corrected] if corrected.keyframes else []
        else:
            added += 1
            new_id = track.id if track.id not in ids else max(ids) + 1
            ids.add(new_id)
            result.append(replace(track, id=new_id))
    kept = {track.id for track in result}
    removed = sum(labelled.track.id not in kept for labelled in video.tracks if labelled.points)
    ordered = sorted(result, key=lambda track: track.id)
    return Corrected(tuple(ordered), changed, added, removed)
