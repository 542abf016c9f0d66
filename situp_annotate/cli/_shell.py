"""Commands that are shown to be typed."""

import shlex
from pathlib import Path

__all__ = ["shell_word"]


def shell_word(path: Path) -> str:
    """A path as a shell takes it for one word, and a command not for an option."""
    text = str(path)
    return shlex.quote(f"./{text}" if text.startswith("-") else text)
