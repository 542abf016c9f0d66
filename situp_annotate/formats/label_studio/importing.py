"""Boxes from a JSON export of Label Studio: regions of type ``videorectangle``.

Of a task with several annotations, the one changed last counts; predictions count where there is
no annotation. The editor shows a region from its first item on, and where an item says
``enabled: false``, up to that frame, this one included, until the next item; so the object is
outside from the picture after it. Frames are found by the clock that the editor counts by
(`label_studio.frames`): its rate is what the items' frames and times say.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import cos, radians, sin
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, TypeAlias
from urllib.parse import parse_qs, unquote, urlsplit

from pydantic import BaseModel, ConfigDict, Field

from situp_annotate.errors import BoxError, SitupError
from situp_annotate.formats.class_labels import checked_label
from situp_annotate.formats.json_files import read_bytes, validate_json
from situp_annotate.formats.label_studio import ID_KEY
from situp_annotate.formats.label_studio.frames import picture_at
from situp_annotate.formats.manifest.slips import attributes_problem
from situp_annotate.formats.seeds import ImportHints, Seeds
from situp_annotate.formats.track_ids import free_track_ids
from situp_annotate.types import NS_PER_S, BoundingBox, Keyframe, Track

__all__ = ["read_label_studio", "recognizes_label_studio"]

_LOWEST_RATE, _HIGHEST_RATE = 1e-3, 1e6
_DECIMALS = 4  # of a pixel; what is beyond comes of the percent
_TAIL_S = 1.0  # sound may go on after the last picture, and the editor's frames with it
_WANTED = "Label Studio's export in its JSON format (not JSON-MIN)"

_Count: TypeAlias = Annotated[int, Field(ge=0, le=2**31 - 1)]


class _Model(BaseModel):
    model_config = ConfigDict(allow_inf_nan=False)


class _Item(_Model):
    frame: _Count
    x: float
    y: float
    width: float
    height: float
    time: float | None = None
    rotation: float = 0.0
    enabled: bool = True
    occluded: bool = False


class _Value(_Model):
    sequence: list[_Item] = []
    labels: list[str] = []
    duration: float | None = None
    frames_count: _Count | None = Field(default=None, alias="framesCount")


class _Region(_Model):
    type: str = ""
    value: _Value = _Value()
    meta: dict[str, Any] | None = None


class _Annotation(_Model):
    result: list[_Region] = []
    was_cancelled: bool = False
    updated_at: str | None = None


class _Task(_Model):
    data: dict[str, Any]
    annotations: list[_Annotation] = []
    predictions: list[_Annotation] = []


def recognizes_label_studio(_path: Path, head: bytes) -> bool:
    """Whether a file that begins like this looks like Label Studio's JSON."""
    begins = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if begins[:1] not in (b"[", b"{"):
        return False
    is_list = begins.startswith(b"[")
    return b'"videorectangle"' in head or (
        is_list and (b'"annotations"' in head or b'"predictions"' in head)
    )


# ---- names, rates, boxes -------------------------------------------------------------------


def _file_name(address: str) -> str:
    """Name of the file at a URL, without what Label Studio puts before uploaded ones."""
    try:
        parts = urlsplit(address)
        path = parse_qs(parts.query).get("d", [unquote(parts.path)])[0]
    except ValueError:
        return ""
    name = PurePosixPath(path.replace("\\", "/")).name
    return re.sub(r"^[0-9a-f]{8}-", "", name) if "/upload/" in path else name


def _video_name(data: dict[str, Any]) -> str:
    others = (value for key, value in data.items() if key != ID_KEY)
    texts = [value for value in (data.get("video"), *others) if isinstance(value, str)]
    names = map(_file_name, texts)
    return next((name for name in names if PurePosixPath(name).suffix), "")


def _rate(values: Sequence[_Value], place: str) -> Fraction:
    """Frames a second by which the editor counted, from frames and times of all items."""
    timed = [(i.frame, i.time) for value in values for i in value.sequence if i.time is not None]
    if timed:
        (start, start_s), (end, end_s) = min(timed), max(timed)
        if start == end:  # the editor's time of frame n is n ÷ rate
            start, start_s = 0, 0.0
        frames, seconds = end - start, end_s - start_s
    else:
        frames, seconds = values[0].frames_count or 0, values[0].duration or 0.0
    rate = frames / seconds if seconds else 0.0
    if not _LOWEST_RATE <= rate <= _HIGHEST_RATE:
        raise SitupError(
            f"{place}: {frames} frames in {seconds} s, as its items say, is no frame rate; give "
            "each item the frame and the time that the editor writes."
        )
    return Fraction(rate)


def _upright(item: _Item, size: tuple[int, int]) -> BoundingBox:
    """The box in pixels; around a turned one, which turns about its top-left corner."""
    x, width = (round(number * size[0] / 100, _DECIMALS) for number in (item.x, item.width))
    y, height = (round(number * size[1] / 100, _DECIMALS) for number in (item.y, item.height))
    box = BoundingBox(x, y, width, height)
    if not item.rotation:
        return box
    angle = radians(item.rotation)  # clockwise, as y points down
    xs = (0.0, width * cos(angle), -height * sin(angle), width * cos(angle) - height * sin(angle))
    ys = (0.0, width * sin(angle), height * cos(angle), width * sin(angle) + height * cos(angle))
    return BoundingBox(x + min(xs), y + min(ys), max(xs) - min(xs), max(ys) - min(ys))


# ---- tasks to seeds ------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Video:
    """What is known of a task's video.

    Attributes
    ----------
    rate : Fraction
        Frames a second by which the editor counted.
    first : int
        Number of the first frame: the editor's 1, or 0 from other writers.
    times_ns : sequence of int
        Time of each picture.
    size : tuple of int
        Width and height in pixels.
    """

    rate: Fraction
    first: int
    times_ns: Sequence[int]
    size: tuple[int, int]

    def picture(self, item: _Item, place: str) -> int:
        """Index of the picture that an item is about."""
        tick = item.frame - self.first + 1
        seconds, end_s = float((tick - 1) / self.rate), self.times_ns[-1] / NS_PER_S
        if seconds > end_s + _TAIL_S:
            raise SitupError(
                f"{place}.frame: frame {item.frame} is shown at {seconds:.3f} s, but the last "
                f"picture of the video is at {end_s:.3f} s; give the video it was drawn on."
            )
        return picture_at(tick, self.rate, self.times_ns)

    def box(self, item: _Item, place: str) -> BoundingBox:
        """The box of an item."""
        try:
            return _upright(item, self.size)
        except BoxError as error:
            raise SitupError(
                f"{place}: x {item.x}, y {item.y}, width {item.width}, height {item.height} (in "
                "percent) is no box; width and height must be more than 0. Delete this item."
            ) from error


def _keyframes(sequence: Sequence[_Item], video: _Video, place: str) -> tuple[Keyframe, ...]:
    placed = [(item, f"{place}.sequence[{number}]") for number, item in enumerate(sequence)]
    keyframes: dict[int, Keyframe] = {}
    for item, where in sorted(placed, key=lambda pair: pair[0].frame):
        frame = video.picture(item, where)
        keyframes[frame] = Keyframe(frame, video.box(item, where), item.occluded)
        keyframes.pop(frame + 1, None)  # of an item before that shows the same picture
        if not item.enabled and frame + 1 < len(video.times_ns):
            keyframes[frame + 1] = Keyframe(frame + 1, None)
    return tuple(keyframes[frame] for frame in sorted(keyframes))


def _chosen(task: _Task) -> tuple[str, list[_Region], list[str]]:
    """The annotation or prediction that counts: its place in the task, its regions, notes."""
    valid = [(number, a) for number, a in enumerate(task.annotations) if not a.was_cancelled]
    kind = "annotations" if valid else "predictions"
    listed = valid or list(enumerate(task.predictions))
    if not listed:
        return "", [], []
    number, chosen = max(listed, key=lambda pair: (pair[1].updated_at or "", pair[0]))
    notes = []
    if len(listed) > 1:
        notes.append(f"Of {len(listed)} {kind}, the one changed last is taken.")
    return f".{kind}[{number}]", chosen.result, notes


def _seeds(task: _Task, place: str, hints: ImportHints) -> Seeds:
    name, video_id = _video_name(task.data), task.data.get(ID_KEY)
    video_id = video_id if isinstance(video_id, str) else ""
    within, results, notes = _chosen(task)
    regions = [
        (region, f"{place}{within}.result[{number}].value")
        for number, region in enumerate(results)
        if region.type == "videorectangle" and region.value.sequence
    ]
    if not regions:
        return Seeds(name, (), tuple(notes), video_id)
    values = [region.value for region, _ in regions]
    items = [item for value in values for item in value.sequence]
    first = min(1, *(item.frame for item in items))
    rate = _rate(values, place)
    video = _Video(rate, first, hints.times_ns(name), hints.size_of(name))
    if first == 0:
        notes.append("Frames are taken to count from 0, since there is a frame 0.")
    if turned := sum(item.rotation != 0 for item in items):
        notes.append(f"{turned} turned boxes are replaced by upright ones around them.")
    ids = free_track_ids([_wanted_id(region) for region, _ in regions])
    tracks = [
        _track(region, number, _keyframes(region.value.sequence, video, where), hints, where)
        for (region, where), number in zip(regions, ids, strict=True)
    ]
    tracks.sort(key=lambda track: track.id)
    return Seeds(name, tuple(tracks), tuple(notes), video_id)


def _wanted_id(region: _Region) -> int | None:
    number = (region.meta or {}).get("track_id")
    return number if type(number) is int else None


def _track(
    region: _Region,
    track_id: int,
    keyframes: tuple[Keyframe, ...],
    hints: ImportHints,
    place: str,
) -> Track:
    named = next((text for text in region.value.labels if text.strip()), hints.label)
    label = checked_label(named, f"{place}.labels")
    attributes = (region.meta or {}).get("attributes")
    if not isinstance(attributes, dict):
        return Track(track_id, label, keyframes)
    if problem := attributes_problem(attributes):
        region_place = place.removesuffix(".value")
        raise SitupError(f"{region_place}.meta.attributes cannot be taken over: {problem}")
    return Track(track_id, label, keyframes, attributes)


def read_label_studio(path: Path, hints: ImportHints) -> list[Seeds]:
    """Read a JSON export of Label Studio: a list of tasks, or one.

    Parameters
    ----------
    path : Path
        The file.
    hints : ImportHints
        Times and sizes of the videos, and the label of regions without one.

    Returns
    -------
    list of Seeds
        One a task, in the order of the file; the name is that of the file at the video's URL.

    Raises
    ------
    SitupError
        If it is no such file, a box is none, or a frame lies behind the video's end.
    """
    content = read_bytes(path)
    if content.lstrip()[:1] == b"{":
        task = validate_json(path, content, _Task, wanted=_WANTED)
        places = [(task, f"{path}: $")]
    else:
        tasks = validate_json(path, content, list[_Task], wanted=_WANTED)
        places = [(task, f"{path}: $[{number}]") for number, task in enumerate(tasks)]
    return [_seeds(task, place, hints) for task, place in places]
