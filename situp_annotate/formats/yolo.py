"""A training set for Ultralytics YOLO: labels, pictures if wanted, and ``data.yaml``.

``labels/<video id>/<frame>.txt`` has a line a box: ``class cx cy w h``, in shares of the picture,
clipped to it; frames are six digits, from 0. A frame without objects has an empty file, as an
example of background. A frame in which an object may be that is not exported has none, for it
would teach that nothing is there: where one is lost, and before the first label of a track.

Training takes five columns and no others, so track ids stand elsewhere: ``tracks`` has the same
files with the track id as a sixth column. ``images/<video id>/<frame>.jpg`` are the decoded frames,
upright, as JPEG of quality 95.
"""

import json
from collections.abc import Collection, Iterable
from pathlib import Path

import cv2

from situp_annotate.errors import OutputError, VideoError
from situp_annotate.formats.clipping import clipped
from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.frame_files import frame_stem
from situp_annotate.formats.labelled import LabelledVideo
from situp_annotate.formats.outside import unsettled_frames
from situp_annotate.types import BoundingBox, Frame, VideoInfo
from situp_annotate.video import open_video

__all__ = ["write_yolo"]

_JPEG_QUALITY = 95

_CONFIG = """\
# Paths start at this file's folder. The same videos stand under train and val: choose which are
# for validation, and take them out of train. Frames of one video are too alike to be divided.
train:
{folders}val:
{folders}names:
{names}"""


def _line(box: BoundingBox, info: VideoInfo) -> str | None:
    """Centre and size as shares of the picture; None if nothing of the box is in it."""
    inside = clipped(box, info.width, info.height)
    if inside is None:
        return None
    width, height = inside.width / info.width, inside.height / info.height
    x = inside.x / info.width + width / 2
    y = inside.y / info.height + height / 2
    numbers = [f"{min(number, 1):.6f}" for number in (x, y, width, height)]
    return None if "0.000000" in numbers[2:] else " ".join(numbers)


def _lines(
    video: LabelledVideo, classes: dict[str, int], options: ExportOptions
) -> dict[int, list[tuple[str, int]]]:
    """Line and track id of each box, by frame."""
    lines: dict[int, list[tuple[str, int]]] = {}
    for track in video.tracks:
        number = classes.setdefault(track.track.label, len(classes))
        for frame, point in track.in_states(options.states).items():
            numbers = _line(point.box, video.info)
            if numbers is not None:
                lines.setdefault(frame, []).append((f"{number} {numbers}", track.track.id))
    return lines


def _settled(video: LabelledVideo, options: ExportOptions) -> list[int]:
    """Frames in which every object has a label or is outside."""
    frames = set(range(video.frame_count))
    for track in video.tracks:
        frames -= unsettled_frames(track, frame_count=video.frame_count, states=options.states)
    return sorted(frames)


def _write_labels(
    video: LabelledVideo,
    frames: Iterable[int],
    folder: Path,
    lines: dict[int, list[tuple[str, int]]],
) -> None:
    for name in ("labels", "tracks"):
        (folder / name / video.id).mkdir(parents=True)
    for frame in frames:
        stem = frame_stem(video.id, frame)
        found = lines.get(frame, [])
        labels = "".join(f"{line}\n" for line, _ in found)
        tracks = "".join(f"{line} {track_id}\n" for line, track_id in found)
        (folder / "labels" / f"{stem}.txt").write_text(labels, encoding="ascii", newline="\n")
        (folder / "tracks" / f"{stem}.txt").write_text(tracks, encoding="ascii", newline="\n")


def _write_picture(frame: Frame, path: Path) -> None:
    done, data = cv2.imencode(".jpg", frame.image, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    if not done:
        raise OutputError(f"{path}: this picture cannot be written as JPEG; export without images.")
    path.write_bytes(data.tobytes())


def _write_pictures(video: LabelledVideo, frames: Collection[int], folder: Path) -> None:
    (folder / "images" / video.id).mkdir(parents=True)
    count = 0
    with open_video(video.info.path, incomplete="keep") as source:
        for frame in source:
            count += 1
            if frame.index in frames:
                path = folder / "images" / f"{frame_stem(video.id, frame.index)}.jpg"
                _write_picture(frame, path)
    if count != video.frame_count:
        raise VideoError(
            f"{video.info.path}: has {count} frames now, but had {video.frame_count} when it was "
            "annotated; annotate it again."
        )


def write_yolo(videos: Iterable[LabelledVideo], folder: Path, options: ExportOptions) -> None:
    """Write ``labels``, ``tracks``, ``data.yaml``, and ``images`` if they are wanted.

    Parameters
    ----------
    videos : iterable of LabelledVideo
        Taken one at a time.
    folder : Path
        Is there and empty.
    options : ExportOptions
        Which labels, and whether with pictures.

    Raises
    ------
    VideoError
        If pictures are wanted and the video cannot be decoded as it was.
    """
    classes: dict[str, int] = {}
    ids = []
    for video in videos:
        lines = _lines(video, classes, options)
        frames = _settled(video, options)
        _write_labels(video, frames, folder, lines)
        if options.images:
            _write_pictures(video, set(frames), folder)
        ids.append(video.id)
    folders = "".join(f"  - {_yaml_text(f'images/{video_id}')}\n" for video_id in ids)
    names = "".join(f"  {number}: {_yaml_text(label)}\n" for label, number in classes.items())
    config = _CONFIG.format(folders=folders, names=names)
    (folder / "data.yaml").write_text(config, encoding="utf-8", newline="\n")


def _yaml_text(text: str) -> str:
    """JSON's strings are YAML's, too, but for characters that YAML refuses or breaks lines at."""
    quoted = json.dumps(text, ensure_ascii=False)
    return "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in quoted)
