"""Read CVAT's XML piece by piece, and nothing that an XML file could do harm with."""

from collections.abc import Iterator
from typing import IO
from xml.etree.ElementTree import Element, ParseError

from defusedxml.ElementTree import iterparse

from situp_annotate.errors import SitupError

__all__ = ["MAX_DEPTH", "MAX_SILENCE", "PIECE", "children_of_annotations"]

MAX_DEPTH = 100
"""Of elements in each other."""

MAX_SILENCE = 2 * 2**20
"""Bytes without a tag: the parser may go through all of them with each further piece."""

PIECE = 64 * 2**10
"""Bytes to give to the parser at a time."""


class _Watched:
    """A stream that ends where there is no tag for too long."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        self.silence = 0

    def read(self, _size: int = -1, /) -> bytes:
        """Give the next piece, whatever size is asked for."""
        piece = self._stream.read(PIECE)
        self.silence += len(piece)
        if self.silence > MAX_SILENCE + PIECE:
            raise ValueError(f"{MAX_SILENCE // 2**20} MiB without a tag")
        return piece


def _events(stream: IO[bytes], place: str) -> Iterator[tuple[str, Element]]:
    watched = _Watched(stream)
    try:
        for event in iterparse(watched, events=("start", "end"), forbid_dtd=True):
            watched.silence = 0
            yield event
    except (ParseError, ValueError, LookupError) as error:  # broken, forbidden, unknown encoding
        raise SitupError(
            f"{place}: this is not XML as CVAT writes it ({error}); export the task again."
        ) from error


def _fault(branch: list[Element]) -> str | None:
    """What is wrong with the last of some elements in each other; None if nothing is."""
    export = 'export the task from CVAT as "CVAT for video 1.1"'
    tag = branch[-1].tag
    if len(branch) == 1 and tag != "annotations":
        return f"this begins with <{tag[:80]}>, not <annotations>; {export}"
    if len(branch) == 2 and tag == "image":
        return (
            f'this holds labels of single pictures, without tracks; {export}, not "CVAT for images"'
        )
    if len(branch) > MAX_DEPTH:
        return "elements are nested too deeply for CVAT's XML; export the task again"
    return None


def children_of_annotations(stream: IO[bytes], place: str) -> Iterator[Element]:
    """Give ``meta``, each ``track`` and so on, whole but for boxes that are no keyframes.

    Parameters
    ----------
    stream : binary file
        Of XML. Document types, and so entities, are refused.
    place : str
        Of the file, for messages.

    Yields
    ------
    Element
        It holds until the next is asked for.

    Raises
    ------
    SitupError
        If this is not XML, is not CVAT's, or has labels of pictures instead of a video.
    """
    branch: list[Element] = []
    kept = 0  # children of the branch's second element: those that follow may be there already
    for event, element in _events(stream, place):
        if event == "start":
            branch.append(element)
            if fault := _fault(branch):
                raise SitupError(f"{place}: {fault}.")
            continue
        branch.pop()
        if len(branch) == 1:
            yield element
            branch[0].clear()
            kept = 0
        elif len(branch) == 2 and element.tag == "box" and element.get("keyframe") == "0":
            del branch[1][kept]  # a long track would need much memory
        elif len(branch) == 2:
            kept += 1
