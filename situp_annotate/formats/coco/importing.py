"""Boxes from COCO with videos: TAO, CocoVID (``instance_id``), and YouTube-VIS (``bboxes``).

A track is what has the same ``track_id``, else ``instance_id``, in a video. ``frame_index`` counts
from 0. ``frame_id`` does too, as in CocoVID, unless a video's are exactly 1, 2, … up to the number
of its images, as ByteTrack's converter writes them. The n-th of ``bboxes`` belongs to frame n.

Between two boxes of a track, an image without one says that the object is outside, from that frame
to the next box, if the image was annotated at all: something else is in it, or it lists the class
as ``neg_category_ids`` (LVIS) and not as ``not_exhaustive_category_ids``. All other frames say
nothing; TAO annotates one a second, and what lies between is for the tracker.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

from situp_annotate.errors import BoxError, SitupError
from situp_annotate.formats.class_labels import checked_label
from situp_annotate.formats.coco.absences import Absences
from situp_annotate.formats.coco.schema import Annotation, Coco, Image, Video
from situp_annotate.formats.json_files import read_bytes, validate_json
from situp_annotate.formats.seeds import ImportHints, Seeds
from situp_annotate.formats.track_ids import free_track_ids
from situp_annotate.types import BoundingBox, Keyframe, Track

__all__ = ["read_coco", "recognizes_coco"]

_WANTED = "COCO with videos, images, annotations and categories"

_Key: TypeAlias = tuple[str, int]
"""What makes boxes of a video one track: the name of a field, and its value."""


@dataclass(slots=True)
class _Found:
    """What is found of one track: boxes by frame."""

    wanted_id: int | None
    label: str
    category: int | None
    boxes: dict[int, Keyframe] = field(default_factory=dict)
    listed: int = 0  # frames of which `bboxes` speaks, from the first


@dataclass(slots=True)
class _Footage:
    """What is found of one video: images by frame, and tracks."""

    entry: Video
    images: dict[int, Image] = field(default_factory=dict)
    tracks: dict[_Key, _Found] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


_Spot: TypeAlias = tuple[_Footage, int]
"""A frame of a video."""


def recognizes_coco(_path: Path, head: bytes) -> bool:
    """Whether a file that begins like this looks like COCO."""
    begins = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    keys = (b'"images"', b'"annotations"', b'"categories"', b'"neg_category_ids"')
    return begins.startswith(b"{") and any(key in head for key in keys)


# ---- images: which frame each is -----------------------------------------------------------


def _count_from_one(
    images: Iterable[Image], videos: Mapping[int | None, _Footage]
) -> set[int | None]:
    """Ids of videos whose ``frame_id`` are 1, 2, … without a gap."""
    numbers: dict[int | None, list[int]] = {}
    for image in images:
        if image.video_id in videos and image.frame_index is None and image.frame_id is not None:
            numbers.setdefault(image.video_id, []).append(image.frame_id)
    found = {video for video, ids in numbers.items() if sorted(ids) == [*range(1, len(ids) + 1)]}
    for video in found:
        videos[video].notes.append("Its frame_id are taken to count from 1.")
    return found


def _place_images(
    coco: Coco, videos: Mapping[int | None, _Footage], place: str
) -> dict[int | None, _Spot]:
    """Put each image into its video; returns where each is, by its id."""
    from_one = _count_from_one(coco.images, videos)
    spots: dict[int | None, _Spot] = {}
    for number, image in enumerate(coco.images):
        where = f"{place}.images[{number}]"
        frame = image.frame_id if image.frame_index is None else image.frame_index
        if frame is None or image.video_id is None:
            raise SitupError(
                f"{where}: this image is no frame of a video; give it video_id and frame_index."
            )
        if image.video_id not in videos:
            raise SitupError(f"{where}.video_id: no video has the id {image.video_id}; add it.")
        if image.frame_index is None and image.video_id in from_one:
            frame -= 1
        video = videos[image.video_id]
        if image.id in spots or frame in video.images:
            raise SitupError(
                f"{where}: id {image.id} or frame {frame} of video {image.video_id} stands there "
                "already; give each frame one image, with an id of its own."
            )
        spots[image.id] = video, frame
        video.images[frame] = image
    return spots


# ---- annotations: boxes by track and frame -------------------------------------------------


class _Annotations:
    """Puts annotations into their videos.

    Parameters
    ----------
    coco : Coco
        The file's content.
    videos : mapping of int to _Footage
        By id.
    spots : mapping of int to tuple
        Video and frame of each image, by id.
    hints : ImportHints
        Names of classes, and the pixels' origin.
    """

    def __init__(
        self,
        coco: Coco,
        videos: Mapping[int | None, _Footage],
        spots: Mapping[int | None, _Spot],
        hints: ImportHints,
    ) -> None:
        self._videos = videos
        self._spots = spots
        self._hints = hints
        self._names = {**hints.labels, **{entry.id: entry.name for entry in coco.categories}}

    def add(self, annotation: Annotation, place: str) -> None:
        """Add the box or boxes of an annotation."""
        if annotation.bboxes is not None:
            self._add_list(annotation, annotation.bboxes, place)
            return
        if annotation.bbox is None:
            raise SitupError(f"{place}: bbox is missing; give x, y, width and height.")
        if annotation.image_id not in self._spots:
            raise SitupError(
                f"{place}.image_id: no image has the id {annotation.image_id}; add it to images."
            )
        video, frame = self._spots[annotation.image_id]
        track = self._track(annotation, video, place)
        self._put(track, frame, annotation.bbox, annotation, f"{place}.bbox")

    def _add_list(
        self, annotation: Annotation, boxes: Sequence[list[float] | None], place: str
    ) -> None:
        """Add the boxes of YouTube-VIS: one a frame of the video, none where it is outside."""
        if annotation.video_id not in self._videos:
            raise SitupError(f"{place}.video_id: no video has the id {annotation.video_id}.")
        track = self._track(annotation, self._videos[annotation.video_id], place)
        track.listed = max(track.listed, len(boxes))
        for frame, box in enumerate(boxes):
            if box is not None:
                self._put(track, frame, box, annotation, f"{place}.bboxes[{frame}]")

    def _track(self, annotation: Annotation, video: _Footage, place: str) -> _Found:
        numbers = {"track_id": annotation.track_id, "instance_id": annotation.instance_id}
        if annotation.bboxes is not None:
            numbers["id"] = annotation.id
        key = next(((name, n) for name, n in numbers.items() if n is not None), None)
        if key is None:
            raise SitupError(
                f"{place}: track_id is missing, so nothing says which boxes are of one object; "
                "give each annotation a track_id or an instance_id."
            )
        if key not in video.tracks:
            own = annotation.instance_id if annotation.instance_id is not None else key[1]
            label = self._label(annotation.category_id, place)
            video.tracks[key] = _Found(own, label, annotation.category_id)
        return video.tracks[key]

    def _label(self, category: int | None, place: str) -> str:
        if category is None:
            return checked_label(self._hints.label, place)
        if category not in self._names:
            raise SitupError(
                f"{place}.category_id: no category has the id {category}; add it to categories."
            )
        name = self._names[category]
        return checked_label(name if name.strip() else self._hints.label, place)

    def _put(
        self, track: _Found, frame: int, bbox: list[float], annotation: Annotation, place: str
    ) -> None:
        origin = self._hints.pixel_origin or 0
        x, y, width, height = bbox
        try:
            box = BoundingBox(x - origin, y - origin, width, height)
        except BoxError as error:
            raise SitupError(
                f"{place}: {bbox} is no box; give x, y, and a width and height of more than 0."
            ) from error
        if frame in track.boxes:
            raise SitupError(
                f"{place}: this track has a box in frame {frame} already; give one box a track "
                "and frame."
            )
        track.boxes[frame] = Keyframe(frame, box, annotation.occluded)


# ---- tracks: boxes and absences ------------------------------------------------------------


def _keyframes(
    boxes: Mapping[int, Keyframe], absent_after: Callable[[int], int | None]
) -> tuple[Keyframe, ...]:
    """The boxes, and ``outside`` where an image says so first after each run of them."""
    keyframes = dict(boxes)
    for frame in boxes:
        absent = absent_after(frame)
        if absent is not None and absent not in boxes:
            keyframes[absent] = Keyframe(absent, None)
    return tuple(keyframes[frame] for frame in sorted(keyframes))


def _track(number: int, found: _Found, absences: Absences) -> Track:
    def listed_after(frame: int) -> int | None:
        return frame + 1 if frame + 1 < found.listed else None

    def absent_after(frame: int) -> int | None:
        return absences.after(frame, found.category)

    after = listed_after if found.listed else absent_after
    return Track(number, found.label, _keyframes(found.boxes, after))


def _seeds(video: _Footage, labelled: set[int | None]) -> Seeds:
    found = [track for track in video.tracks.values() if track.boxes]
    absences = Absences(video.images, labelled)
    ids = free_track_ids([track.wanted_id for track in found])
    tracks = [_track(number, track, absences) for number, track in zip(ids, found, strict=True)]
    tracks.sort(key=lambda track: track.id)
    return Seeds(video.entry.file_name or video.entry.name, tuple(tracks), tuple(video.notes))


def read_coco(path: Path, hints: ImportHints) -> list[Seeds]:
    """Read boxes with track ids from COCO with videos.

    Parameters
    ----------
    path : Path
        The file.
    hints : ImportHints
        The label of boxes without a class, names of classes that the file does not name, and the
        coordinate of the picture's top-left corner, which is 0 in COCO.

    Returns
    -------
    list of Seeds
        One a video, in the order of the file. Crowds (``iscrowd``) are left out.

    Raises
    ------
    SitupError
        If it is no such file, ids point nowhere, boxes have no track, or one is no box.
    """
    coco = validate_json(path, read_bytes(path), Coco, wanted=_WANTED)
    place = f"{path}: $"
    videos: dict[int | None, _Footage] = {entry.id: _Footage(entry) for entry in coco.videos}
    annotations = _Annotations(coco, videos, _place_images(coco, videos, place), hints)
    for number, annotation in enumerate(coco.annotations):
        if not annotation.iscrowd:
            annotations.add(annotation, f"{place}.annotations[{number}]")
    labelled = {annotation.image_id for annotation in coco.annotations}
    return [_seeds(video, labelled) for video in videos.values()]
