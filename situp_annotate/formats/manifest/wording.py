"""How problems of a manifest are worded: the place, the value, what is allowed."""

import json
import re
from dataclasses import dataclass
from typing import Any, TypeAlias

from situp_annotate.formats.manifest.schema import SUPPORTED_VERSION
from situp_annotate.types import MOST_PIXELS, Extend, Method

__all__ = ["RULES", "Json", "Place", "Problem", "rule_at", "show_place", "show_value"]

Json: TypeAlias = Any
"""What a JSON parser returns, of whatever shape."""

Place: TypeAlias = tuple[str | int, ...]
"""Where a value stands: the keys and list indices that lead to it from the top."""

MAX_SHOWN_CHARACTERS = 60

_FRAME = "frame must be a whole number from 0 to 2147483647"
_BOX = "box must be four numbers: x, y, width, height"

RULES = {
    "": "the manifest must be an object with version and videos",
    "$schema": "$schema must be text",
    "version": f"version must be {SUPPORTED_VERSION}",
    "videos": "videos must be a list of at least one video",
    "videos[]": 'a video must be an object such as {"path": "clips/street.mp4", "tracks": []}',
    "videos[].path": "path must be the text of a path to a video or a folder of pictures",
    "videos[].id": (
        "id must be text that can name a folder: 1 to 100 characters, no / or \\, no control "
        "characters, no dot at its start, no space at its ends, and none of batch.json, logs and "
        "report.html"
    ),
    "videos[].tracks": "tracks must be a list (an empty one if there is nothing to track)",
    "videos[].info": "info must be an object with width, height, frame_rate, frames, or left out",
    "info.width": "width must be a whole number of 1 or more",
    "info.height": "height must be a whole number of 1 or more",
    "info.frame_rate": 'frame_rate must be a number greater than 0 or text such as "30000/1001"',
    "info.frames": "frames must be a whole number of 0 or more",
    "tracks[]": "a track must be an object with id, label, and keyframes or frame and box",
    "tracks[].id": "id must be a whole number from 1 to 2147483647",
    "tracks[].label": (
        "label must be text that is not empty and has no control characters, such as line breaks"
    ),
    "tracks[].attributes": "attributes must be an object",
    "tracks[].method": f"method must be one of {', '.join(Method)}",
    "tracks[].extend": f"extend must be one of {', '.join(Extend)}",
    "tracks[].keyframes": "keyframes must be a list of at least one keyframe",
    "tracks[].frame": _FRAME,
    "tracks[].box": _BOX,
    "keyframes[]": 'a keyframe must be an object such as {"frame": 0, "box": [10, 20, 30, 40]}',
    "keyframes[].frame": _FRAME,
    "keyframes[].box": _BOX,
    "keyframes[].occluded": "occluded must be true or false",
    "keyframes[].outside": "outside must be true or false",
    "box[0]": f"x must be a number from -{MOST_PIXELS} to {MOST_PIXELS}",
    "box[1]": f"y must be a number from -{MOST_PIXELS} to {MOST_PIXELS}",
    "box[2]": f"width must be greater than 0 and at most {MOST_PIXELS}",
    "box[3]": f"height must be greater than 0 and at most {MOST_PIXELS}",
}
"""What is allowed at each kind of place, as problems say it."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong, and where."""

    place: Place
    text: str


def show_place(place: Place) -> str:
    """Return the place as a JSON path, such as ``$.videos[0].path``."""
    path = "$"
    for part in place:
        if isinstance(part, int):
            path += f"[{part}]"
        elif re.fullmatch(r"[A-Za-z_$][\w$]{,59}", part, re.ASCII):
            path += f".{part}"
        else:
            path += f"[{show_value(part)}]"
    return path


def show_value(value: object) -> str:
    """Return a value as JSON on one line, shortened where it is long."""
    if isinstance(value, dict):
        return "an object" if value else "{}"
    if isinstance(value, list) and (
        len(value) > 8 or any(isinstance(v, dict | list) for v in value)
    ):
        return f"a list of {len(value)}"
    text = json.dumps(value, ensure_ascii=False).encode("utf-8", "backslashreplace").decode()
    if len(text) > MAX_SHOWN_CHARACTERS:
        text = text[: MAX_SHOWN_CHARACTERS - 1] + "…"
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def rule_at(place: Place) -> str:
    """Return what is allowed at a place of a manifest."""
    names = ["[]" if isinstance(part, int) else part for part in place]
    if len(place) >= 2 and place[-2] == "box":
        return RULES[f"box[{place[-1]}]"]
    if names and names[-1] == "[]":
        return RULES["".join(names[-2:])]
    owner = names[:-1]
    if owner and owner[-1] == "[]":
        return RULES[f"{owner[-2]}[].{names[-1]}"]
    return RULES[".".join(names[-2:])]
