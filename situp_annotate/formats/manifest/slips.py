"""What Python's JSON parser lets slip: repeated keys, NaN, half characters, bottomless nesting."""

import math
from collections.abc import Iterator

from situp_annotate.formats.manifest.wording import Json, Place, Problem, show_place, show_value

__all__ = ["attributes_problem", "is_encodable", "slip", "slips"]

MAX_DEPTH = 50
_LEVELS_ABOVE_ATTRIBUTES = 5  # $.videos[0].tracks[0].attributes


def is_encodable(text: str) -> bool:
    """Whether a text is valid Unicode."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def slip(value: object) -> str | None:
    """Say what is wrong with a number or a text by itself; None if nothing is."""
    if isinstance(value, float) and not math.isfinite(value):
        return f"{show_value(value)} is not allowed; numbers must be finite."
    if isinstance(value, str) and not is_encodable(value):
        return "half of a surrogate pair is not allowed; text must be valid Unicode."
    return None


def _children(value: object) -> Iterator[tuple[str | int, Json]]:
    if isinstance(value, dict):
        yield from value.items()
    elif isinstance(value, list):
        yield from enumerate(value)


def slips(
    document: Json, repeated_keys: dict[int, list[str]], levels: int = MAX_DEPTH
) -> Iterator[Problem]:
    """Yield what is no JSON, though Python reads it, and what nests too deeply.

    Parameters
    ----------
    document : object
        The parsed JSON, of any shape.
    repeated_keys : dict
        For the ``id()`` of an object of the document, the keys that its text gives repeatedly.
    levels : int
        How deeply it may nest.
    """
    if text := slip(document):
        yield Problem((), text)
    # A stack of its own: documents may nest deeper than Python recurses.
    pending: list[Iterator[tuple[Place, Json]]] = [iter([((), document)])]
    while pending:
        place, value = next(pending[-1], ((), None))
        if value is None:
            pending.pop()
            continue
        if len(place) > levels:
            yield Problem(place, f"nested too deeply; at most {levels} levels are allowed.")
            continue
        for repeated in repeated_keys.get(id(value), ()):
            yield Problem(
                (*place, repeated),
                "this key is given more than once; keep one, since only one counts.",
            )
        for key, child in _children(value):
            if text := slip(key) or slip(child):
                yield Problem((*place, key), text)
        pending.append(_inner(place, value))


def _inner(place: Place, value: Json) -> Iterator[tuple[Place, Json]]:
    for key, child in _children(value):
        if isinstance(child, dict | list):
            yield (*place, key), child


def attributes_problem(attributes: Json) -> str | None:
    """Say what is in a track's attributes that no manifest can hold; None if there is nothing."""
    for problem in slips(attributes, {}, MAX_DEPTH - _LEVELS_ABOVE_ATTRIBUTES):
        return f"{show_place(problem.place)}: {problem.text}"
    return None
