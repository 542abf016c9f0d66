"""Go through a CVAT XML as it is parsed: no tree is built, so its size does not matter."""

from collections import Counter
from dataclasses import dataclass, field
from typing import IO, Any
from xml.etree.ElementTree import ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser

from situp_annotate.formats.cvat.xml import MAX_DEPTH, MAX_SILENCE, PIECE
from situp_annotate.inspection.rows import Tally

__all__ = ["CvatSurvey", "read_cvat"]

_MAX_TEXT = 10_000
_MAX_NAMES = 1000
_CORNERS = ("xtl", "ytl", "xbr", "ybr")
_OTHER_SHAPES = frozenset(
    {"cuboid", "ellipse", "mask", "points", "polygon", "polyline", "skeleton", "tag"}
)


@dataclass(slots=True)
class _TrackWalk:
    """The track that is being read."""

    name: str
    last_frame: int | None = None
    ended: bool = False
    has_keyframe: bool = False


@dataclass(slots=True)
class CvatSurvey:
    """Called by the parser at every tag; keeps figures, no tree."""

    root: str = ""
    texts: dict[str, str] = field(default_factory=dict)
    labels: list[str] = field(default_factory=list)
    used_labels: Counter[str] = field(default_factory=Counter)
    tracks: int = 0
    images: int = 0
    image_boxes: int = 0
    boxes: int = 0
    keyframes: int = 0
    outside: int = 0
    last_frame: int = -1
    others: Counter[str] = field(default_factory=Counter)
    tally: Tally = field(default_factory=Tally)
    tags: int = 0
    _path: list[str] = field(default_factory=list)
    _text: str = ""
    _track: _TrackWalk | None = None

    # ---- what the parser calls

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Take in an opening tag."""
        self.tags += 1
        if len(self._path) > MAX_DEPTH:
            raise ValueError("tags are nested too deeply")
        self._path.append(tag)
        self._text = ""
        if len(self._path) == 1:
            self.root = tag
        elif tag == "track":
            self._start_track(attributes)
        elif tag == "image":
            self.images += 1
        elif tag == "box":
            self._add_box(attributes)
        elif tag in _OTHER_SHAPES and self._path[-2] in {"track", "image"}:
            self.others[tag] += 1

    def end(self, tag: str) -> None:
        """Take in a closing tag."""
        place = "/".join(self._path[1:])
        if place.endswith("labels/label/name") and len(self.labels) < _MAX_NAMES:
            self.labels.append(self._text)
        elif place.startswith("meta/") or place == "version":
            if len(self.texts) < _MAX_NAMES:
                self.texts.setdefault(tag, self._text)
        elif tag == "track" and self._track is not None:
            self._end_track(self._track)
        self._path.pop()
        self._text = ""

    def data(self, text: str) -> None:
        """Take in text between tags."""
        if len(self._text) < _MAX_TEXT:
            self._text += text

    def close(self) -> None:
        """Take in the end of the document."""

    # ---- what is kept

    def _start_track(self, attributes: dict[str, str]) -> None:
        self.tracks += 1
        label = attributes.get("label", "")
        self._track = _TrackWalk(f"track {attributes.get('id', '?')[:20]} ({label[:40]!r})")
        if label in self.used_labels or len(self.used_labels) < _MAX_NAMES:
            self.used_labels[label] += 1

    def _end_track(self, track: _TrackWalk) -> None:
        if not track.has_keyframe:
            self.tally.add("no_keyframe", track.name)
        self._track = None

    def _add_box(self, attributes: dict[str, str]) -> None:
        track = self._track
        if track is None:
            self.image_boxes += "image" in self._path
            return
        self.boxes += 1
        try:
            frame = int(attributes["frame"])
            left, top, right, bottom = (float(attributes[key]) for key in _CORNERS)
        except (KeyError, ValueError):
            self.tally.add("not_a_box", f"{track.name}, box {self.boxes} of the file")
            return
        place = f"{track.name}, frame {frame}"
        outside = attributes.get("outside", "0") == "1"
        is_keyframe = attributes.get("keyframe", "1") == "1"
        self.keyframes += is_keyframe
        self.outside += outside
        self.last_frame = max(self.last_frame, frame)
        if not (left < right and top < bottom) and not outside:
            self.tally.add("empty_box", place)
        self._follow(track, place, frame, outside=outside, is_keyframe=is_keyframe)

    def _follow(
        self, track: _TrackWalk, place: str, frame: int, *, outside: bool, is_keyframe: bool
    ) -> None:
        started = track.last_frame is not None
        if frame == track.last_frame:
            self.tally.add("double", place)
        elif outside and track.ended:
            self.tally.add("double_end", place)
        elif frame < (track.last_frame or 0):
            self.tally.add("unsorted", place)
        if not is_keyframe and outside != track.ended and started:
            self.tally.add("lost_switch", place)
        track.last_frame = max(track.last_frame or 0, frame)
        track.ended = outside
        track.has_keyframe = track.has_keyframe or is_keyframe


def read_cvat(file: IO[bytes], survey: CvatSurvey) -> str | None:
    """Feed the parser; return what is wrong with the document, if anything."""
    parser: Any = DefusedXMLParser(target=survey, forbid_dtd=True)
    silence, tags = 0, 0
    try:
        while piece := file.read(PIECE):
            parser.feed(piece)
            silence = 0 if survey.tags > tags else silence + len(piece)
            tags = survey.tags
            if silence > MAX_SILENCE:
                mebibytes = MAX_SILENCE // 2**20
                return f"there are {mebibytes} MiB without a tag, which no annotation tool writes"
        parser.close()
    except ParseError as error:
        return f"it is not well-formed: {error}"
    except DefusedXmlException as error:
        return f"it defines entities or points to other files, which is not read ({error})"
    except (ValueError, LookupError) as error:
        return f"it is no XML that an annotation tool writes ({error})"
    return None
