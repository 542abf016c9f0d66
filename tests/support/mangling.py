"""Files gone wrong in a way that still looks right: JSON and XML with a few values changed."""

import copy
import json
from xml.etree import ElementTree

from hypothesis import strategies as st

__all__ = ["mangled", "mangled_words", "mangled_xml"]

_ODD = st.sampled_from(
    [None, True, -1, 0, 1, 2**31, 10**30, 1e308, -1e308, 0.5, "", "x", "1", [], {}, [[]], [1, 2]]
)
_ODD_JSON = st.sampled_from(
    ["NaN", "-Infinity", "1e999", "1e-400", "9" * 400, "9" * 5000, '"\\ud800"', '"\\u0000"']
    + ['"\\u001b[31m"', '"../.."', '"/"', '"\\u2028"', '"\\uffff"', '"<script>"', '"1/0"']
    + ["[" * 60 + "]" * 60, '{"a":' * 180 + "1" + "}" * 180, "[" * 900 + "]" * 900]
    + ['{"id": 1, "id": 2}', f'"{"x" * 300}"']
)
"""What Python does not write, but others may."""

_ODD_WORDS = st.sampled_from(
    ["", "-1", "0", "1e999", "1e308", "nan", "-inf", "0x10", "1_0", "１２", "1.5", "9" * 400]
    + ["9" * 5000, "2147483647", "2147483648", " 1 ", "true", "../..", "\u2028", "\u202e"]
    + ["x" * 300]
)


# ---- JSON ----------------------------------------------------------------------------------


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


_MARK = "to be replaced"


@st.composite
def mangled(draw, document):
    """Text of the document after one to three changes, at times cut off."""
    document = copy.deepcopy(document)
    for _ in range(draw(st.integers(1, 3))):
        place = draw(st.sampled_from(list(_places(document))))
        kind = draw(st.sampled_from(["replace", "remove", "repeat"]))
        document = _change(document, place, kind, draw(_ODD | st.just(_MARK)))
    text = json.dumps(document)
    while f'"{_MARK}"' in text:
        text = text.replace(f'"{_MARK}"', draw(_ODD_JSON), 1)
    return text[: draw(st.integers(0, len(text)))] if draw(st.integers(0, 9)) == 0 else text


# ---- XML -----------------------------------------------------------------------------------


def _rearranged(draw, parents):
    """Take an element out, put it in once more, or call it something else."""
    parent = draw(st.sampled_from(parents))
    child = draw(st.sampled_from(list(parent)))
    match draw(st.sampled_from(["remove", "repeat", "move", "rename"])):
        case "remove":
            parent.remove(child)
        case "repeat":
            parent.append(copy.deepcopy(child))
        case "move":
            draw(st.sampled_from(parents)).append(copy.deepcopy(child))
        case _:
            child.tag = draw(st.sampled_from(["box", "track", "meta", "image", "task", "x"]))


def _rewritten(draw, element):
    """Change an attribute of an element, or its text."""
    name = draw(st.sampled_from([*element.attrib, "keyframe", "task_id", "rotation", "text"]))
    if name == "text":
        element.text = draw(_ODD_WORDS)
    elif draw(st.booleans()):
        element.attrib.pop(name, None)
    else:
        element.set(name, draw(_ODD_WORDS))


@st.composite
def mangled_xml(draw, text):
    """An XML document after one to four changes of its elements, attributes and texts."""
    root = ElementTree.fromstring(text)
    for _ in range(draw(st.integers(1, 4))):
        elements = list(root.iter())
        parents = [element for element in elements if len(element)]
        if parents and draw(st.booleans()):
            _rearranged(draw, parents)
        else:
            _rewritten(draw, draw(st.sampled_from(elements)))
    return ElementTree.tostring(root, encoding="unicode")


# ---- rows, and whatever has words -----------------------------------------------------------


@st.composite
def mangled_words(draw, text, separators):
    """Lines of words after one to four changes: of a word, or of whole lines."""
    rows = [_divided(line, separators) for line in text.splitlines()]
    for _ in range(draw(st.integers(1, 4))):
        row = draw(st.integers(0, len(rows) - 1))
        kind = draw(st.sampled_from(["word", "word", "word", "remove", "repeat", "swap"]))
        if kind == "word":
            rows[row][2 * draw(st.integers(0, len(rows[row]) // 2))] = draw(_ODD_WORDS)
        elif kind == "remove" and len(rows) > 1:
            del rows[row]
        elif kind == "repeat":
            rows.insert(row, list(rows[row]))
        else:
            other = draw(st.integers(0, len(rows) - 1))
            rows[row], rows[other] = rows[other], rows[row]
    return "\n".join("".join(row) for row in rows) + "\n"


def _divided(line, separators):
    """Words at even places, and what is between them at odd ones."""
    pieces = [""]
    for character in line:
        if character in separators:
            pieces += [character, ""]
        else:
            pieces[-1] += character
    return pieces
