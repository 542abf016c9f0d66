"""Text that any XML file may hold."""

import re

__all__ = ["xml_text"]

_NOT_IN_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def xml_text(text: str) -> str:
    """Put a sign for what no XML file may hold, not even escaped."""
    return _NOT_IN_XML.sub("\ufffd", text)
