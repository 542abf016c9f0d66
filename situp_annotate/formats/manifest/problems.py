"""Find everything that is wrong with a parsed manifest, each with its place and what is allowed.

Three passes look at the raw document, so that one malformed part hides nothing of the rest:
what JSON lets slip (repeated keys, NaN), the shape of each entry (the models of
``schema``), and the rules between entries.
"""

import difflib
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeGuard

from pydantic import BaseModel, ValidationError

from situp_annotate.formats.manifest.ids import comparable_id, default_id
from situp_annotate.formats.manifest.schema import (
    SUPPORTED_VERSION,
    InfoEntry,
    KeyframeEntry,
    ManifestEntry,
    TrackEntry,
    VideoEntry,
)
from situp_annotate.formats.manifest.wording import (
    RULES,
    Json,
    Place,
    Problem,
    rule_at,
    show_place,
    show_value,
)

__all__ = ["find_problems"]

MAX_DEPTH = 50

_ENTRIES: dict[str, type[BaseModel]] = {
    "": ManifestEntry,
    "videos": VideoEntry,
    "info": InfoEntry,
    "tracks": TrackEntry,
    "keyframes": KeyframeEntry,
}


def _value_at(document: Json, place: Place) -> Json:
    for part in place:
        document = document[part]
    return document


# ---- what JSON lets slip -------------------------------------------------------------------


def _encodable(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def _slip(value: object) -> str | None:
    if isinstance(value, float) and not math.isfinite(value):
        return f"{show_value(value)} is not allowed; numbers must be finite."
    if isinstance(value, str) and not _encodable(value):
        return "half of a surrogate pair is not allowed; text must be valid Unicode."
    return None


def _children(value: object) -> Iterator[tuple[str | int, Json]]:
    if isinstance(value, dict):
        yield from value.items()
    elif isinstance(value, list):
        yield from enumerate(value)


def _slips(document: Json, repeated_keys: dict[int, list[str]]) -> Iterator[Problem]:
    # A stack of its own: documents may nest deeper than Python recurses.
    pending: list[tuple[Place, Json]] = [((), document)]
    while pending:
        place, value = pending.pop()
        if len(place) > MAX_DEPTH:
            yield Problem(place, f"nested too deeply; at most {MAX_DEPTH} levels are allowed.")
            continue
        for repeated in repeated_keys.get(id(value), ()):
            yield Problem(
                (*place, repeated),
                "this key is given more than once; keep one, since only one counts.",
            )
        if text := _slip(value):
            yield Problem(place, text)
        for key, child in _children(value):
            if text := _slip(key):
                yield Problem((*place, key), text)
            pending.append(((*place, key), child))


# ---- the shape of each entry ---------------------------------------------------------------


def _unknown_key(place: Place) -> str:
    owner = next((part for part in reversed(place[:-1]) if isinstance(part, str)), "")
    fields = _ENTRIES[owner].model_fields
    known = [field.alias or name for name, field in fields.items()]
    near = difflib.get_close_matches(str(place[-1]).lower(), known, n=1)
    if near:
        return f'unknown key; did you mean "{near[0]}"?'
    return f"unknown key; the keys allowed here are {', '.join(known)}."


def _misshapen(document: Json) -> Iterator[Problem]:
    try:
        ManifestEntry.model_validate(document)
    except ValidationError as error:
        for detail in error.errors(include_url=False, include_context=False):
            place: Place = detail["loc"]
            if detail["type"] == "extra_forbidden":
                yield Problem(place, _unknown_key(place))
            elif detail["type"] == "missing":
                yield Problem(place, f"missing; {rule_at(place)}.")
            elif _slip(value := _value_at(document, place)) is None:  # slips are told already
                yield Problem(place, f"{show_value(value)} is not allowed; {rule_at(place)}.")


# ---- rules between entries -----------------------------------------------------------------


def _entries(owner: dict[str, Any], key: str) -> list[tuple[int, dict[str, Any]]]:
    items = owner.get(key)
    if not isinstance(items, list):
        return []
    return [(index, item) for index, item in enumerate(items) if isinstance(item, dict)]


def _is_whole(value: object) -> TypeGuard[int]:
    return type(value) is int


def _path_problem(path: str, folder: Path) -> str | None:
    allowed = "paths must stay in the manifest's folder, unless --allow-outside is given"
    if Path(path).is_absolute():
        return f"{show_value(path)} is absolute; {allowed}."
    try:
        inside = (folder / path).resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):  # a loop of symbolic links
        return f"{show_value(path)} cannot be followed to its end; {allowed}."
    return None if inside else f"{show_value(path)} leads outside; {allowed}."


def _is_usable_path(path: object) -> TypeGuard[str]:
    return isinstance(path, str) and path != "" and "\0" not in path and _encodable(path)


def _video_problems(
    document: dict[str, Any], folder: Path, *, allow_outside: bool
) -> Iterator[Problem]:
    owners: dict[str, Place] = {}
    for index, video in _entries(document, "videos"):
        place: Place = ("videos", index)
        path, given_id = video.get("path"), video.get("id")
        if _is_usable_path(path) and not allow_outside and (text := _path_problem(path, folder)):
            yield Problem((*place, "path"), text)
        if isinstance(given_id, str):
            video_id, at = given_id, "id"
            allowed = "ids must differ by more than upper and lower case"
        elif "id" not in video and _is_usable_path(path):
            video_id, at = default_id(path, folder), "path"
            allowed = 'give one of the two an "id" of its own'
        else:
            continue
        owner = owners.setdefault(comparable_id(video_id), place)
        if owner != place:
            text = f"the id {show_value(video_id)} is that of {show_place(owner)} already"
            yield Problem((*place, at), f"{text}; {allowed}.")


def _track_problems(place: Place, video: dict[str, Any]) -> Iterator[Problem]:
    owners: dict[int, Place] = {}
    for index, track in _entries(video, "tracks"):
        at: Place = (*place, "tracks", index)
        track_id = track.get("id")
        if _is_whole(track_id) and owners.setdefault(track_id, at) != at:
            yield Problem(
                (*at, "id"),
                f"{track_id} is not allowed; {show_place(owners[track_id])} has this id, and "
                "ids must differ within a video.",
            )
        if "keyframes" in track:
            for key in ("frame", "box"):
                if key in track:
                    yield Problem(
                        (*at, key),
                        f"{key} is not allowed beside keyframes; give either keyframes or one "
                        "frame and box.",
                    )
        elif "frame" not in track and "box" not in track:
            yield Problem(at, "nothing says where the object is; give keyframes or frame and box.")
        else:
            for key in ("frame", "box"):
                if key not in track:
                    yield Problem((*at, key), f"missing; {rule_at((*at, key))}.")
        yield from _keyframe_problems(at, track)


def _keyframe_problems(place: Place, track: dict[str, Any]) -> Iterator[Problem]:
    owners: dict[int, Place] = {}
    previous = -1
    for index, keyframe in _entries(track, "keyframes"):
        at: Place = (*place, "keyframes", index)
        yield from _box_or_outside_problems(at, keyframe)
        frame = keyframe.get("frame")
        if not _is_whole(frame):
            continue
        if owners.setdefault(frame, at) != at:
            text = f"{show_place(owners[frame])} is at this frame already; one of them must go"
            yield Problem((*at, "frame"), f"{frame} is not allowed; {text}.")
        elif 0 <= frame < previous:
            text = f"the keyframe before is at {previous}, and frames must increase"
            yield Problem((*at, "frame"), f"{frame} is not allowed; {text}.")
        previous = frame


def _box_or_outside_problems(place: Place, keyframe: dict[str, Any]) -> Iterator[Problem]:
    outside = keyframe.get("outside") is True
    if outside and "box" in keyframe:
        yield Problem(
            (*place, "box"),
            "a box is not allowed where outside is true; the object either has left or has a box.",
        )
    elif outside and place[-1] == 0:
        yield Problem(
            (*place, "outside"),
            "true is not allowed in the first keyframe; a track must begin with a box.",
        )
    elif not outside and "box" not in keyframe:
        yield Problem(
            (*place, "box"), 'missing; give a box, or "outside": true if the object has left.'
        )


# ---- all together --------------------------------------------------------------------------


def _position(document: Json, place: Place) -> tuple[int, ...]:
    # Sorts by place in the text: keys count in the order they were written, missing ones first.
    position = []
    for part in place:
        if isinstance(document, dict):
            position.append(list(document).index(part) if part in document else -1)
            document = document.get(part)
        else:
            position.append(int(part))
            document = document[part]
    return tuple(position)


def find_problems(
    document: Json, repeated_keys: dict[int, list[str]], folder: Path, *, allow_outside: bool
) -> list[Problem]:
    """Return every problem of a manifest, in the order of the document.

    Parameters
    ----------
    document : object
        The parsed JSON, of any shape.
    repeated_keys : dict
        For the ``id()`` of an object of the document, the keys that its text gives repeatedly.
    folder : Path
        The manifest's folder, which paths start from.
    allow_outside : bool
        Whether paths may be absolute or lead out of the folder.
    """
    if isinstance(document, dict):
        version = document.get("version")
        if _is_whole(version) and version != SUPPORTED_VERSION:
            # Another version means other rules: whatever else these would find is noise.
            text = (
                f"{show_value(version)} is not supported; {RULES['version']}, the only one known."
            )
            return [Problem(("version",), text)]
    problems = list(_slips(document, repeated_keys))
    problems += _misshapen(document)
    if isinstance(document, dict):
        problems += _video_problems(document, folder, allow_outside=allow_outside)
        for index, video in _entries(document, "videos"):
            problems += _track_problems(("videos", index), video)
    return sorted(problems, key=lambda problem: _position(document, problem.place))
