"""How a track's attributes stand in CVAT, where they are text, and may change from box to box.

Of a track, an attribute that stays the same is one value. One that changes is a list of pairs
``[frame, text]``, by frame: each text holds from its frame to the next pair's.
"""

import json
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

__all__ = ["change_frames", "changes", "from_texts", "text_at"]


def from_texts(texts: Mapping[int, str]) -> str | list[list[int | str]]:
    """Make an attribute's value of its text at some frames, in order; at least one."""
    frames = list(texts)
    first = texts[frames[0]]
    steps = [frame for before, frame in pairwise(frames) if texts[frame] != texts[before]]
    if not steps:
        return first
    return [[frame, texts[frame]] for frame in (frames[0], *steps)]


def changes(value: Any) -> bool:  # noqa: ANN401
    """Whether an attribute's value is a list of pairs, frame and text."""
    if not isinstance(value, list) or not value:
        return False
    for pair in value:
        match pair:
            case [int(), str()]:
                continue
            case _:
                return False
    return True


def change_frames(attributes: Mapping[str, Any]) -> set[int]:
    """Frames from which on the text of one of a track's attributes is another."""
    lists = (value for value in attributes.values() if changes(value))
    return {frame for pairs in lists for frame, _ in pairs[1:]}


def text_at(value: Any, frame: int) -> str:  # noqa: ANN401
    """Text of an attribute in a frame; before the first pair, the first pair's."""
    if changes(value):
        past = [text for start, text in value if start <= frame]
        return str(past[-1] if past else value[0][1])
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
