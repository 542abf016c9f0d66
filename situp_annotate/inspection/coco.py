"""What a COCO file holds: of videos (TAO, YouTube-VIS) or of single pictures."""

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from situp_annotate.inspection.report import FileReport, Grade, Remark, count
from situp_annotate.inspection.rows import Fault, Tally

__all__ = ["inspect_coco", "is_coco"]


def is_coco(document: Any) -> bool:  # noqa: ANN401 - whatever a JSON parser returns
    """Whether a JSON document has COCO's lists."""
    return (
        isinstance(document, dict)
        and isinstance(document.get("annotations"), list)
        and any(isinstance(document.get(key), list) for key in ("images", "videos"))
    )


@dataclass(slots=True)
class _Survey:
    videos: set[Any]
    images: dict[Any, dict[str, Any]]
    categories: dict[Any, str]
    annotations: int = 0
    tracks: set[Any] = field(default_factory=set)
    used: Counter[str] = field(default_factory=Counter)
    tally: Tally = field(default_factory=Tally)
    _pairs: set[tuple[Any, Any]] = field(default_factory=set)

    def add_image(self, image: dict[str, Any]) -> None:
        place = f"image {image.get('id')}"
        if "video_id" in image:
            if image["video_id"].__hash__ is None or image["video_id"] not in self.videos:
                self.tally.add("no_video", place)
            if not isinstance(image.get("frame_index", image.get("frame_id")), int):
                self.tally.add("no_frame", place)

    def add(self, annotation: dict[str, Any]) -> None:
        self.annotations += 1
        place = f"annotation {annotation.get('id')}"
        category = _key(annotation.get("category_id"))
        if category not in self.categories:
            self.tally.add("no_category", place)
        else:
            self.used[self.categories[category]] += 1
        image = _key(annotation.get("image_id"))
        if image not in self.images:
            self.tally.add("no_image", place)
        track = _key(annotation.get("track_id", annotation.get("instance_id")))
        if track is None:
            self.tally.add("no_track", place)
        else:
            self.tracks.add(track)
            if (image, track) in self._pairs:
                self.tally.add("double", place)
            self._pairs.add((image, track))
        if not _is_box(annotation.get("bbox")):
            self.tally.add("not_a_box", place)


def _key(value: object) -> int | str | None:
    return value if isinstance(value, int | str) else None


def _is_box(value: object) -> bool:
    if not isinstance(value, list) or len(value) != 4:
        return False
    if not all(isinstance(side, int | float) and -math.inf < side < math.inf for side in value):
        return False
    return bool(value[2] > 0 and value[3] > 0)


def _dicts(document: dict[str, Any], key: str) -> list[dict[str, Any]]:
    entries = document.get(key)
    return [e for e in entries if isinstance(e, dict)] if isinstance(entries, list) else []


def inspect_coco(path: Path, document: dict[str, Any]) -> FileReport:
    """Report on a document with COCO's lists."""
    annotations, images = _dicts(document, "annotations"), _dicts(document, "images")
    videos = _dicts(document, "videos")
    if any("bboxes" in annotation for annotation in annotations[:100]):
        return _youtube_vis(path, len(videos), len(annotations))
    survey = _Survey(
        videos={_key(video.get("id")) for video in videos},
        images={_key(image.get("id")): image for image in images},
        categories={
            _key(category.get("id")): str(category.get("name"))[:40]
            for category in _dicts(document, "categories")
        },
    )
    for image in images:
        survey.add_image(image)
    for annotation in annotations:
        survey.add(annotation)
    of_videos = bool(videos) or any("video_id" in image for image in images[:100])
    facts = (
        ("videos", str(len(videos)) if of_videos else "none"),
        ("pictures", str(len(images))),
        ("boxes", str(survey.annotations)),
        ("tracks", str(len(survey.tracks))),
        ("classes", ", ".join(f"{name}: {n}" for name, n in survey.used.most_common(20)) or "–"),
    )
    kind, name = ("coco_video", "COCO-video") if of_videos else ("coco", "COCO")
    title = f"{name}, {count(survey.annotations, 'box', 'boxes')}"
    remarks = tuple(_remarks(survey, of_videos=of_videos))
    return FileReport(path, kind, title, facts, remarks)


def _youtube_vis(path: Path, videos: int, annotations: int) -> FileReport:
    remark = Remark(
        Grade.PROBLEM,
        "youtube_vis",
        "Every annotation is a whole track with a list of boxes (YouTube-VIS). That form is not "
        "read here; give each box an annotation of its own with image_id and track_id (as TAO "
        "does).",
    )
    facts = (("videos", str(videos)), ("tracks", str(annotations)))
    title = f"YouTube-VIS, {count(annotations, 'track')}"
    return FileReport(path, "youtube_vis", title, facts, (remark,))


def _remarks(survey: _Survey, *, of_videos: bool) -> Iterator[Remark]:
    if not of_videos:
        yield Remark(
            Grade.PROBLEM,
            "no_videos",
            "This is COCO of single pictures: nothing says which picture is which frame of which "
            "video. videos, and video_id and frame_index of each image, are needed.",
        )
        return
    if survey.annotations == 0:
        yield Remark(Grade.WARNING, "empty", "There is no annotation in it.")
    yield from survey.tally.remarks(_FAULTS)
    frames = [
        image["frame_index"]
        for image in survey.images.values()
        if isinstance(image.get("frame_index"), int)
    ]
    if frames and min(frames) == 1:
        yield Remark(
            Grade.NOTE,
            "frames_from_1",
            "The lowest frame_index is 1. COCO-video counts from 0; if the first picture of the "
            "video is meant, every box comes a frame too late.",
        )


_FAULTS = (
    Fault(
        Grade.PROBLEM,
        "not_a_box",
        "annotation",
        "No bbox of four numbers with a positive width and height",
        "Outlines alone are not read; write the bbox beside the segmentation.",
    ),
    Fault(
        Grade.PROBLEM,
        "no_image",
        "annotation",
        "image_id of no image",
        "pycocotools stumbles over that; add the image or take the annotation out.",
    ),
    Fault(
        Grade.PROBLEM,
        "no_category",
        "annotation",
        "category_id of no category",
        "Add the category, or nobody knows what it is.",
    ),
    Fault(
        Grade.PROBLEM,
        "no_video",
        "image",
        "video_id of no video",
        "Add the video, or take the image out.",
    ),
    Fault(
        Grade.PROBLEM,
        "no_frame",
        "image",
        "No frame_index",
        "Without it nothing says which frame of the video it is.",
    ),
    Fault(
        Grade.PROBLEM,
        "double",
        "annotation",
        "A second box of a track in the same image",
        "It is not clear which one is meant. Keep one.",
    ),
    Fault(
        Grade.WARNING,
        "no_track",
        "annotation",
        "No track_id or instance_id",
        "Nothing joins such a box to others; each would be an object of its own.",
    ),
)
