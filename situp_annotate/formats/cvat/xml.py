"""Read CVAT's XML piece by piece, and nothing that an XML file could do harm with."""

from collections.abc import Iterator
from typing import IO
from xml.etree.ElementTree import Element, ParseError

from defusedxml.ElementTree import iterparse

from situp_annotate.errors import SitupError

__all__ = ["children_of_annotations"]


def _events(stream: IO[bytes], place: str) -> Iterator[tuple[str, Element]]:
    try:
        yield from iterparse(stream, events=("start", "end"), forbid_dtd=True)
    except (ParseError, ValueError, LookupError) as error:  # broken, forbidden, unknown encoding
        raise SitupError(
            f"{place}: this is not XML as CVAT writes it ({error}); export the task again."
        ) from error


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
    for event, element in _events(stream, place):
        if event == "start":
            branch.append(element)
            if len(branch) == 1 and element.tag != "annotations":
                raise SitupError(
                    f"{place}: this begins with <{element.tag}>, not <annotations>; export the "
                    f'task from CVAT as "CVAT for video 1.1".'
                )
            if len(branch) == 2 and element.tag == "image":
                raise SitupError(
                    f"{place}: this holds labels of single pictures, without tracks; export the "
                    f'task from CVAT as "CVAT for video 1.1", not "CVAT for images".'
                )
            continue
        branch.pop()
        if len(branch) == 1:
            yield element
            branch[0].clear()
        elif len(branch) == 2 and element.tag == "box" and element.get("keyframe") == "0":
            branch[1].remove(element)  # a long track would need much memory
