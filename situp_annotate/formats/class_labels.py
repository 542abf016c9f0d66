"""What may be the label of an object: the name of its class."""

import unicodedata

from situp_annotate.errors import SitupError

__all__ = ["checked_label", "is_label"]

_REFUSED = ("Cc", "Cs", "Zl", "Zp")
"""Unicode's categories of control characters, surrogates, and what else ends a line."""


def is_label(text: str) -> bool:
    """Whether a text can stand in tables and captions: visible, on one line."""
    return bool(text.strip()) and all(unicodedata.category(c) not in _REFUSED for c in text)


def checked_label(text: str, place: str) -> str:
    """Give back the label that another tool, or a person, gives an object.

    Parameters
    ----------
    text : str
        The label.
    place : str
        File and place that it comes from.

    Raises
    ------
    SitupError
        If it is no label.
    """
    if not is_label(text):
        raise SitupError(
            f"{place}: {text[:80]!r} cannot be a label; give one that is not empty and has no "
            "control characters, such as tabs and line breaks."
        )
    return text
