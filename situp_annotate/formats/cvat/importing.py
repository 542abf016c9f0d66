"""Import from "CVAT for video 1.1": XML, or the zip archive that CVAT packs it into.

Only the boxes marked as keyframes are taken: CVAT has put the others between them. Tracks have
CVAT's ids plus one, since ours count from 1. Of what CVAT draws, only boxes can be tracked: other
shapes are left out, and a turned box is replaced by the upright one around it.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar
from xml.etree.ElementTree import Element

from situp_annotate.errors import BoxError, SitupError
from situp_annotate.formats.class_labels import checked_label
from situp_annotate.formats.cvat.attributes import from_texts
from situp_annotate.formats.cvat.xml import children_of_annotations
from situp_annotate.formats.seeds import ImportHints, Seeds
from situp_annotate.formats.zipped import open_readable, opened, zipped_names
from situp_annotate.types import BoundingBox, Keyframe, Track

__all__ = ["read_cvat", "recognizes_cvat"]

_ZIPPED = "annotations.xml"
_LARGEST = 2**31 - 1
"""Of ids and frames."""

_T = TypeVar("_T")


def recognizes_cvat(path: Path, head: bytes) -> bool:
    """Whether a file is CVAT's XML, or an archive with it."""
    if head.startswith(b"PK"):
        return _ZIPPED in zipped_names(path)
    return b"<annotations" in head


# ---- values in attributes of elements --------------------------------------------------------


def _value(
    element: Element, name: str, convert: Callable[[str], _T], allowed: str, place: str
) -> _T:
    text = element.get(name)
    if text is None:
        raise SitupError(f"{place}: {name} is missing; give {allowed}.")
    try:
        return convert(text)
    except ValueError as error:
        raise SitupError(
            f"{place}: {name}={text[:80]!r} is not allowed; give {allowed}."
        ) from error


def _whole(element: Element, name: str, place: str) -> int:
    def convert(text: str) -> int:
        number = int(text)
        if not 0 <= number < _LARGEST:
            raise ValueError
        return number

    return _value(element, name, convert, f"a whole number from 0 to {_LARGEST - 1}", place)


def _flag(element: Element, name: str, place: str, *, default: bool | None = None) -> bool:
    if default is not None and element.get(name) is None:
        return default
    return _value(element, name, ["0", "1"].index, "0 or 1", place) == 1


def _number(element: Element, name: str, place: str) -> float:
    def convert(text: str) -> float:
        number = float(text)
        if not math.isfinite(number):
            raise ValueError
        return number

    return _value(element, name, convert, "a number", place)


# ---- tracks ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _CvatTrack:
    """A track, and what is known of it besides.

    Attributes
    ----------
    track : Track or None
        None if the track has no box.
    notes : tuple of str
        What was left out.
    """

    track: Track | None
    notes: tuple[str, ...]


def _upright(box: BoundingBox, degrees: float) -> BoundingBox:
    """The upright box around one that is turned about its centre."""
    cos, sin = abs(math.cos(math.radians(degrees))), abs(math.sin(math.radians(degrees)))
    width = box.width * cos + box.height * sin
    height = box.width * sin + box.height * cos
    return BoundingBox(
        box.x + (box.width - width) / 2, box.y + (box.height - height) / 2, width, height
    )


def _box(element: Element, origin: int, place: str) -> BoundingBox:
    left, top, right, bottom = (
        _number(element, name, place) - origin for name in ("xtl", "ytl", "xbr", "ybr")
    )
    try:
        # As decimal as it was written: 10.3 - 10.1 is 0.20000000000000107.
        box = BoundingBox(left, top, round(right - left, 6), round(bottom - top, 6))
        if element.get("rotation"):
            box = _upright(box, _number(element, "rotation", place))
    except BoxError as error:
        raise SitupError(f"{place}: {error}") from error
    return box


def _is_outside(element: Element, place: str) -> bool:
    return _flag(element, "outside", place, default=False)


def _keyframes(boxes: list[tuple[int, Element]], origin: int, place: str) -> tuple[Keyframe, ...]:
    by_frame: dict[int, Keyframe] = {}
    for frame, element in boxes:
        where = f"{place}, box at frame {frame}"
        outside = _is_outside(element, where)
        keyframe = Keyframe(
            frame,
            None if outside else _box(element, origin, where),
            not outside and _flag(element, "occluded", where, default=False),
        )
        if by_frame.setdefault(frame, keyframe) != keyframe:
            raise SitupError(f"{where}: there is another box at this frame; leave one of them.")
    keyframes: list[Keyframe] = []
    for keyframe in by_frame.values():
        # To be outside before the first box, or again, says nothing new.
        if keyframe.box or (keyframes and keyframes[-1].box):
            keyframes.append(keyframe)
    return tuple(keyframes)


def _attributes(
    boxes: list[tuple[int, Element]], place: str
) -> dict[str, str | list[list[int | str]]]:
    texts: dict[str, dict[int, str]] = {}
    for frame, element in boxes:
        if not _is_outside(element, place):
            for attribute in element.iter("attribute"):
                name = _value(attribute, "name", str, "a name", f"{place}, box at frame {frame}")
                texts.setdefault(name, {})[frame] = attribute.text or ""
    return {name: from_texts(by_frame) for name, by_frame in texts.items()}


def _track(element: Element, origin: int, path: Path) -> _CvatTrack:
    track_id = _whole(element, "id", f"{path}: a track")
    unnamed = f"{path}: track {track_id}"
    label = checked_label(_value(element, "label", str, "a label", unnamed), unnamed)
    who = f'track {track_id} ("{label[:80]}")'
    place = f"{path}: {who}"
    keys = [box for box in element.findall("box") if _flag(box, "keyframe", place)]
    boxes = sorted(((_whole(box, "frame", place), box) for box in keys), key=lambda entry: entry[0])
    keyframes = _keyframes(boxes, origin, place)
    notes = []
    if shapes := sorted({shape.tag for shape in element if shape.tag != "box"}):
        drawn = ", ".join(shapes)[:80]
        notes.append(f"In {who}, only boxes were taken, nothing that is drawn as {drawn}.")
    if any(box.get("rotation") for box in keys):
        notes.append(f"In {who}, turned boxes were replaced by the upright ones around them.")
    if not keyframes:
        notes.append(f"CVAT's {who} was left out, for it has no box.")
    track = Track(track_id + 1, label, keyframes, _attributes(boxes, place)) if keyframes else None
    return _CvatTrack(track, tuple(notes))


# ---- the file --------------------------------------------------------------------------------


def _names(meta: Element) -> dict[str | None, str]:
    """Name of each task's video or, if it has none, of the task; by id, and of the first."""
    names: dict[str | None, str] = {}
    source = meta.findtext("source")
    for task in (*meta.iter("task"), *meta.iter("job")):
        name = task.findtext("source") or source or task.findtext("name") or ""
        names.setdefault(None, name)
        names.setdefault(task.findtext("id"), name)
    return names


def _check_ids(tasks: Iterable[list[_CvatTrack]], path: Path) -> None:
    seen: set[int] = set()
    for track in (entry.track for entries in tasks for entry in entries if entry.track):
        if track.id in seen:
            raise SitupError(f"{path}: there are two tracks {track.id - 1}; give each its own id.")
        seen.add(track.id)


def _seeds(
    found: Sequence[_CvatTrack], task_id: str | None, names: Mapping[str | None, str]
) -> Seeds:
    tracks = [entry.track for entry in found if entry.track]
    return Seeds(
        name=names.get(task_id, names.get(None, "")),
        tracks=tuple(sorted(tracks, key=lambda track: track.id)),
        notes=tuple(note for entry in found for note in entry.notes),
    )


def read_cvat(path: Path, hints: ImportHints) -> list[Seeds]:
    """Read the keyframes of a task, or of every task of a project.

    Parameters
    ----------
    path : Path
        An XML file, or a zip archive with ``annotations.xml``.
    hints : ImportHints
        ``pixel_origin`` (0).

    Returns
    -------
    list of Seeds
        One a task that has tracks. Attributes of a track are text; one that changes is a list of
        pairs, frame and text, each from its frame on.

    Raises
    ------
    SitupError
        If the file cannot be read, is no XML or another kind of it, or holds values that are not
        allowed.
    """
    names: dict[str | None, str] = {}
    found: dict[str | None, list[_CvatTrack]] = {}
    with opened(path, _ZIPPED) as file, open_readable(file) as stream:
        for element in children_of_annotations(stream, str(file)):
            if element.tag == "meta":
                names = _names(element)
            elif element.tag == "track":
                entry = _track(element, hints.pixel_origin or 0, path)
                found.setdefault(element.get("task_id"), []).append(entry)
    _check_ids(found.values(), path)
    return [_seeds(entries, task, names) for task, entries in (found or {None: []}).items()]
