"""The shape of each entry of a manifest by itself: its keys and what their values may be."""

import difflib
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel, Field, ValidationError

from situp_annotate.formats.manifest.schema import (
    InfoEntry,
    KeyframeEntry,
    ManifestEntry,
    TrackEntry,
    VideoEntry,
)
from situp_annotate.formats.manifest.slips import slip
from situp_annotate.formats.manifest.wording import Json, Place, Problem, rule_at, show_value

__all__ = ["misshapen"]

MAX_KEYS = 1000

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


def _known_keys(place: Place) -> list[str]:
    """Keys of the entry at a place."""
    kind = next((part for part in reversed(place) if isinstance(part, str)), "")
    return [field.alias or name for name, field in _ENTRIES[kind].model_fields.items()]


def _unknown_key(place: Place) -> str:
    known = _known_keys(place[:-1])
    near = difflib.get_close_matches(str(place[-1]).lower(), known, n=1)
    if near:
        return f'unknown key; did you mean "{near[0]}"?'
    return f"unknown key; the keys allowed here are {', '.join(known)}."


class _Videos(ManifestEntry):
    videos: list[Any] = Field(min_length=1)


class _Tracks(VideoEntry):
    tracks: list[Any]
    info: Any = None


class _Keyframes(TrackEntry):
    keyframes: list[Any] | None = Field(default=None, min_length=1)


def misshapen(document: Json) -> Iterator[Problem]:
    """Yield the problems of each entry by itself.

    One entry is looked at after the other: a model of all of them would gather the problems of a
    million entries before it tells of the first.
    """
    yield from _entry_problems(_Videos, (), document)
    for video_place, video in _items((), document, "videos"):
        yield from _entry_problems(_Tracks, video_place, video)
        if isinstance(video, dict) and video.get("info") is not None:
            yield from _entry_problems(InfoEntry, (*video_place, "info"), video["info"])
        for track_place, track in _items(video_place, video, "tracks"):
            yield from _entry_problems(_Keyframes, track_place, track)
            for place, keyframe in _items(track_place, track, "keyframes"):
                yield from _entry_problems(KeyframeEntry, place, keyframe)


def _items(place: Place, owner: Json, key: str) -> Iterator[tuple[Place, Json]]:
    items = owner.get(key) if isinstance(owner, dict) else None
    if isinstance(items, list):
        for index, item in enumerate(items):
            yield (*place, key, index), item


def _entry_problems(model: type[BaseModel], place: Place, entry: Json) -> Iterator[Problem]:
    if isinstance(entry, dict) and len(entry) > MAX_KEYS:
        keys = ", ".join(_known_keys(place))
        yield Problem(place, f"{len(entry)} keys are too many; the keys allowed here are {keys}.")
        return
    try:
        model.model_validate(entry)
    except ValidationError as error:
        for detail in error.errors(include_url=False, include_context=False):
            at: Place = (*place, *detail["loc"])
            if detail["type"] == "extra_forbidden":
                yield Problem(at, _unknown_key(at))
            elif detail["type"] == "missing":
                yield Problem(at, f"missing; {rule_at(at)}.")
            elif slip(value := _value_at(entry, detail["loc"])) is None:  # told already
                yield Problem(at, f"{show_value(value)} is not allowed; {rule_at(at)}.")
