"""Find everything that is wrong with a parsed manifest, each with its place and what is allowed.

Three passes look at the raw document, so that one malformed part hides nothing of the rest: the
shape of each entry, what JSON lets slip, and the rules between entries, which are here.
"""

from collections.abc import Iterator
from itertools import chain, islice
from pathlib import Path
from typing import Any, TypeGuard

from situp_annotate.formats.manifest.ids import comparable_id, default_id
from situp_annotate.formats.manifest.schema import SUPPORTED_VERSION
from situp_annotate.formats.manifest.shape import misshapen
from situp_annotate.formats.manifest.slips import is_encodable, slips
from situp_annotate.formats.manifest.wording import (
    RULES,
    Json,
    Place,
    Problem,
    rule_at,
    show_place,
    show_value,
)

__all__ = ["MAX_PROBLEMS", "find_problems"]

MAX_PROBLEMS = 1000
"""Those beyond are not looked for."""


def _entries(owner: dict[str, Any], key: str) -> Iterator[tuple[int, dict[str, Any]]]:
    items = owner.get(key)
    if isinstance(items, list):
        yield from ((index, item) for index, item in enumerate(items) if isinstance(item, dict))


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
    return isinstance(path, str) and path != "" and "\0" not in path and is_encodable(path)


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


def _track_problems(place: Place, video: dict[str, Any], max_tracks: int) -> Iterator[Problem]:
    tracks = video.get("tracks")
    if isinstance(tracks, list) and len(tracks) > max_tracks:
        yield Problem(
            (*place, "tracks"),
            f"{len(tracks)} tracks are more than limits.max_tracks = {max_tracks} allows; raise "
            "the limit, or leave some for another run.",
        )
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


def _rules_broken(
    document: Json, folder: Path, *, allow_outside: bool, max_tracks: int
) -> Iterator[Problem]:
    if isinstance(document, dict):
        yield from _video_problems(document, folder, allow_outside=allow_outside)
        for index, video in _entries(document, "videos"):
            yield from _track_problems(("videos", index), video, max_tracks)


# ---- all together --------------------------------------------------------------------------


def _in_order(document: Json, problems: list[Problem]) -> list[Problem]:
    """Sort by place in the text: keys in the order they were written, missing ones first."""
    ranks: dict[int, dict[str | int, int]] = {}

    def position(problem: Problem) -> tuple[int, ...]:
        inner, result = document, []
        for part in problem.place:
            if isinstance(inner, dict):
                if id(inner) not in ranks:
                    ranks[id(inner)] = {key: rank for rank, key in enumerate(inner)}
                result.append(ranks[id(inner)].get(part, -1))
                inner = inner.get(part)
            else:
                result.append(int(part))
                inner = inner[part]
        return tuple(result)

    return sorted(problems, key=position)


def find_problems(
    document: Json,
    repeated_keys: dict[int, list[str]],
    folder: Path,
    *,
    allow_outside: bool,
    max_tracks: int,
) -> list[Problem]:
    """Return the problems of a manifest, all of them up to a thousand, in the document's order.

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
    max_tracks : int
        How many tracks a video may have.
    """
    if isinstance(document, dict):
        version = document.get("version")
        if _is_whole(version) and version != SUPPORTED_VERSION:
            # Another version means other rules: whatever else these would find is noise.
            text = (
                f"{show_value(version)} is not supported; {RULES['version']}, the only one known."
            )
            return [Problem(("version",), text)]
    found = chain(
        misshapen(document),
        slips(document, repeated_keys),
        _rules_broken(document, folder, allow_outside=allow_outside, max_tracks=max_tracks),
    )
    return _in_order(document, [*islice(found, MAX_PROBLEMS)])
