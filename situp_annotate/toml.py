"""Read TOML that anybody may have written."""

import json
import tomllib
from typing import Any

__all__ = ["parse_toml", "parse_value"]


def parse_toml(text: str) -> dict[str, Any]:
    """Read a document.

    Raises
    ------
    tomllib.TOMLDecodeError
        If it is none, is nested too deeply, or has a number that nobody could print.
    """
    try:
        document = tomllib.loads(text)
        json.dumps(document, default=str)
    except tomllib.TOMLDecodeError:
        raise
    except ValueError:  # Python neither reads nor writes integers of more than 4300 digits
        raise tomllib.TOMLDecodeError("a number has too many digits") from None
    except RecursionError:
        raise tomllib.TOMLDecodeError("it is nested too deeply") from None
    return document


def parse_value(text: str) -> object:
    """A value of a setting: TOML, or else a bare word."""
    try:
        return parse_toml(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text.strip()
