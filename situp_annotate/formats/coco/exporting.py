"""COCO with videos and tracks, as TAO has it: one ``coco.json`` for all videos.

``images`` are the frames, every one, with ``video_id`` and ``frame_index`` from 0; annotations have
an ``image_id``, a ``track_id`` that is unique in the file, and the track's own id in its video as
``instance_id``; boxes are x, y, width, height, 0-based. ``state``, ``provenance`` and ``occluded``
are added to what COCO knows. Which absences are meant is said as LVIS and TAO say it: an image
lists the class of every object that may be in it without a label as
``not_exhaustive_category_ids``: where a label is left out, since its state is not wanted, and
before the first label of a track. An image without any box lists all other classes of its video as
``neg_category_ids``.

A video goes to disk before the next is read: the lists of the file are written side by side, and
joined at the end.
"""

import json
import shutil
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any

from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.frame_files import frame_stem
from situp_annotate.formats.labelled import LabelledTrack, LabelledVideo
from situp_annotate.formats.outside import unsettled_frames
from situp_annotate.types import State, TrackPoint

__all__ = ["write_coco"]

_FILE = "coco.json"
_LISTS = ("images", "annotations", "tracks", "videos", "categories")


class _List:
    """One list of the file, in a file of its own until all is known."""

    def __init__(self, file: IO[str]) -> None:
        self._file = file
        self._ids = count(1)

    def add(self, entry: Mapping[str, Any]) -> int:
        """Append an object; returns the id it is given, from 1."""
        number = next(self._ids)
        text = json.dumps({"id": number, **entry}, ensure_ascii=False, allow_nan=False)
        self._file.write(text if number == 1 else f",\n{text}")
        return number

    def copy_to(self, target: IO[str]) -> None:
        """Append the whole list to a file."""
        self._file.seek(0)
        shutil.copyfileobj(self._file, target)


class _CocoFile:
    """The lists of one ``coco.json`` in the making."""

    def __init__(self, lists: Mapping[str, _List], options: ExportOptions) -> None:
        self._lists = lists
        self._options = options
        self._categories: dict[str, int] = {}

    def add(self, video: LabelledVideo) -> None:
        """Add a video, its tracks, frames and labels."""
        classes = {track.track.id: self._category(track.track.label) for track in video.tracks}
        open_classes = _open_classes(video, classes, self._options)
        video_id = self._lists["videos"].add(
            {
                "name": video.id,
                "file_name": video.info.path.name,
                "width": video.info.width,
                "height": video.info.height,
                "length": video.frame_count,
                "fps": float(video.info.frame_rate),
                "neg_category_ids": [],
                "not_exhaustive_category_ids": sorted(set().union(*open_classes.values())),
            }
        )
        boxes = self._boxes(video)
        image_ids = {}
        for frame in range(video.frame_count):
            image: dict[str, Any] = {
                "video_id": video_id,
                "frame_index": frame,
                "file_name": f"{frame_stem(video.id, frame)}.jpg",
                "width": video.info.width,
                "height": video.info.height,
            }
            unsettled = open_classes.get(frame, set())
            if unsettled:
                image["not_exhaustive_category_ids"] = sorted(unsettled)
            if frame not in boxes:
                image["neg_category_ids"] = sorted(set(classes.values()) - unsettled)
            image_ids[frame] = self._lists["images"].add(image)
        for track in video.tracks:
            self._add_track(track, video_id, image_ids)

    def _boxes(self, video: LabelledVideo) -> set[int]:
        tracks = (track.in_states(self._options.states) for track in video.tracks)
        return {frame for points in tracks for frame in points}

    def _add_track(self, track: LabelledTrack, video_id: int, image_ids: dict[int, int]) -> None:
        category = self._category(track.track.label)
        owner = {"video_id": video_id, "category_id": category}
        track_id = self._lists["tracks"].add({**owner, "instance_id": track.track.id})
        for frame, point in track.in_states(self._options.states).items():
            self._lists["annotations"].add(
                {
                    **owner,
                    "image_id": image_ids[frame],
                    "track_id": track_id,
                    "instance_id": track.track.id,
                    **_label(point),
                }
            )

    def _category(self, label: str) -> int:
        if label not in self._categories:
            self._categories[label] = self._lists["categories"].add({"name": label})
        return self._categories[label]


def _open_classes(
    video: LabelledVideo, classes: Mapping[int, int], options: ExportOptions
) -> dict[int, set[int]]:
    """Classes of objects that may be in a frame without a label, by frame."""
    found: dict[int, set[int]] = {}
    for track in video.tracks:
        for frame in unsettled_frames(track, frame_count=video.frame_count, states=options.states):
            found.setdefault(frame, set()).add(classes[track.track.id])
    return found


def _label(point: TrackPoint) -> dict[str, Any]:
    box = point.box
    return {
        "bbox": [box.x, box.y, box.width, box.height],
        "area": box.width * box.height,
        "iscrowd": 0,
        "score": point.confidence,
        "state": point.state,
        "provenance": point.provenance,
        "occluded": point.state is not State.VISIBLE,
    }


def write_coco(videos: Iterable[LabelledVideo], folder: Path, options: ExportOptions) -> None:
    """Write ``coco.json``.

    Parameters
    ----------
    videos : iterable of LabelledVideo
        Taken one at a time.
    folder : Path
        Is there and empty.
    options : ExportOptions
        Which labels.
    """
    with ExitStack() as stack:
        files = {
            name: stack.enter_context(TemporaryFile("w+", encoding="utf-8", dir=folder))
            for name in _LISTS
        }
        lists = {name: _List(file) for name, file in files.items()}
        coco = _CocoFile(lists, options)
        for video in videos:
            coco.add(video)
        with (folder / _FILE).open("w", encoding="utf-8", newline="\n") as target:
            target.write('{"info": {"description": "Written by situp-annotate"}')
            for name, entries in lists.items():
                target.write(f',\n"{name}": [\n')
                entries.copy_to(target)
                target.write("\n]")
            target.write("}\n")
