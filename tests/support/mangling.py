"""JSON gone wrong: a sound document with values replaced, removed or repeated, or cut."""

import copy
import json

from hypothesis import strategies as st

__all__ = ["mangled"]

_ODD = st.sampled_from(
    [None, True, -1, 0, 1, 2**31, 10**30, 1e308, -1e308, 0.5, "", "x", "1", [], {}, [[]], [1, 2]]
)


def _places(value, place=()):
    """The place of every value in a document."""
    yield place
    children = value.items() if isinstance(value, dict) else ()
    children = enumerate(value) if isinstance(value, list) else children
    for key, child in children:
        yield from _places(child, (*place, key))


def _change(document, place, kind, odd):
    if not place:
        return copy.deepcopy(odd) if kind == "replace" else document
    *owner, last = place
    holder = document
    for key in owner:
        holder = holder[key]
    if kind == "replace":
        holder[last] = copy.deepcopy(odd)
    elif kind == "remove":
        del holder[last]
    elif isinstance(holder, list):
        holder.append(copy.deepcopy(holder[last]))
    return document


@st.composite
def mangled(draw, document):
    """Text of the document after one to three changes, at times cut off."""
    document = copy.deepcopy(document)
    for _ in range(draw(st.integers(1, 3))):
        place = draw(st.sampled_from(list(_places(document))))
        kind = draw(st.sampled_from(["replace", "remove", "repeat"]))
        document = _change(document, place, kind, draw(_ODD))
    text = json.dumps(document)
    return text[: draw(st.integers(0, len(text)))] if draw(st.integers(0, 9)) == 0 else text
