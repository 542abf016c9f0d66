"""H.264 and H.265 byte streams (Annex B): what a coded picture begins with."""

from collections.abc import Iterator
from dataclasses import dataclass

__all__ = ["ANNEXB_CODECS", "PictureHead", "read_head"]

_START_CODE = b"\0\0\1"


@dataclass(frozen=True, slots=True)
class _Syntax:
    """Where a codec's NAL units carry their type, and which types are what."""

    shift: int
    mask: int
    slices: frozenset[int]
    keyframe_slices: frozenset[int]
    parameter_sets: frozenset[int]


_SYNTAXES = {
    # ITU-T H.264, table 7-1: a picture that decoding can start at is an IDR picture.
    "h264": _Syntax(0, 0x1F, frozenset(range(1, 6)), frozenset({5}), frozenset({7, 8})),
    # ITU-T H.265, table 7-1: any IRAP picture; the sets are VPS, SPS and PPS.
    "hevc": _Syntax(
        1, 0x3F, frozenset(range(32)), frozenset(range(16, 24)), frozenset({32, 33, 34})
    ),
}

ANNEXB_CODECS = frozenset(_SYNTAXES)
"""FFmpeg's names of the codecs that are known here."""


@dataclass(frozen=True, slots=True)
class PictureHead:
    """What a coded picture begins with.

    Attributes
    ----------
    keyframe : bool
        Whether decoding can start at it.
    parameter_sets : bool
        Whether all parameter sets that its codec has stand before it.
    """

    keyframe: bool
    parameter_sets: bool


def read_head(data: bytes, codec: str) -> PictureHead | None:
    """Look at the NAL units up to the first slice.

    Parameters
    ----------
    data : bytes
        A coded picture as a byte stream.
    codec : str
        One of `ANNEXB_CODECS`.

    Returns
    -------
    PictureHead or None
        None when there is no slice, and thus no picture.
    """
    syntax = _SYNTAXES[codec]
    seen: set[int] = set()
    for kind in _unit_types(data, syntax):
        if kind in syntax.slices:
            return PictureHead(kind in syntax.keyframe_slices, syntax.parameter_sets <= seen)
        seen.add(kind)
    return None


def _unit_types(data: bytes, syntax: _Syntax) -> Iterator[int]:
    place = data.find(_START_CODE) + len(_START_CODE)
    while len(_START_CODE) <= place < len(data):
        yield data[place] >> syntax.shift & syntax.mask
        place = data.find(_START_CODE, place) + len(_START_CODE)
