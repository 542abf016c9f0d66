"""Label Studio: predictions to import, and the labelling interface that fits them.

``label_studio.json`` has a task a video. A track is a region of type ``videorectangle``: thinned
keyframes in percent of the picture, between which the editor interpolates; ``enabled: false``
where labels end; ``occluded`` in addition, which the editor carries along. A task's data says
where the video is (``/data/local-files/?d=NAME``, Label Studio's own address for files of a folder
that it serves), at how many frames a second the editor has to count, and as ``situp_id`` which
video of the run it is; ``label_config.xml`` takes the frame rate of each task from there.

Label Studio takes no box that is wider or higher than the picture, so such a box is clipped, and
none that lies wholly outside, so such a box is left out.
"""

import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import zip_longest
from pathlib import Path
from typing import Any
from urllib.parse import quote
from xml.sax.saxutils import quoteattr

from situp_annotate.errors import VideoError
from situp_annotate.formats.clipping import clipped
from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.keyframed import keyframes_of
from situp_annotate.formats.label_studio import ID_KEY
from situp_annotate.formats.label_studio.frames import clock_rate, on_clock, tick_count
from situp_annotate.formats.labelled import LabelledTrack, LabelledVideo
from situp_annotate.formats.xml_text import xml_text
from situp_annotate.types import Keyframe, TrackPoint, VideoInfo

__all__ = ["write_label_studio"]

_TASKS_FILE = "label_studio.json"
_CONFIG_FILE = "label_config.xml"

_PIXEL_DECIMALS = 3
_PERCENT_DECIMALS = 6  # finer than _PIXEL_DECIMALS for pictures of up to 100 000 pixels

_MOST_FRAMES = 5_000_000
"""Of a task: a label is made for each, and a stray time can make any number of them."""

_CONFIG = """\
<View>
  <Video name="video" value="$video" frameRate="$fps"/>
  <VideoRectangle name="box" toName="video"/>
  <Labels name="label" toName="video">
{labels}  </Labels>
</View>
"""


def _drawable(point: TrackPoint, info: VideoInfo) -> TrackPoint | None:
    """The point with a box that Label Studio takes, if anything of it can be drawn."""
    inside = clipped(point.box, info.width, info.height)
    if inside is None:
        return None
    too_large = point.box.width > info.width or point.box.height > info.height
    return replace(point, box=inside) if too_large else point


def _drawable_track(track: LabelledTrack, info: VideoInfo) -> LabelledTrack:
    drawable = {frame: _drawable(point, info) for frame, point in track.points.items()}
    return replace(track, points={f: point for f, point in drawable.items() if point is not None})


def _item(keyframe: Keyframe, *, ends: bool, info: VideoInfo, rate: Fraction) -> dict[str, Any]:
    box = keyframe.box
    assert box is not None
    percent = {
        "x": 100 * box.x / info.width,
        "y": 100 * box.y / info.height,
        "width": 100 * box.width / info.width,
        "height": 100 * box.height / info.height,
    }
    return {
        "frame": keyframe.frame,
        "time": keyframe.frame / float(rate),  # as the editor writes it, a frame later than shown
        **{name: round(number, _PERCENT_DECIMALS) for name, number in percent.items()},
        "rotation": 0,
        "enabled": not ends,
        "occluded": keyframe.occluded,
    }


def _sequence(
    keyframes: Sequence[Keyframe], info: VideoInfo, rate: Fraction
) -> list[dict[str, Any]]:
    """One item a box; a box that nothing follows is the last that is shown."""
    return [
        _item(keyframe, ends=after is not None and after.box is None, info=info, rate=rate)
        for keyframe, after in zip_longest(keyframes, keyframes[1:])
        if keyframe.box is not None
    ]


def _mean(points: Iterable[TrackPoint]) -> float:
    scores = [point.confidence for point in points]
    return round(sum(scores) / len(scores), 6) if scores else 0.0


def _region(
    track: LabelledTrack, video: LabelledVideo, rate: Fraction, options: ExportOptions
) -> dict[str, Any] | None:
    """The region of a track; None if there is nothing to show of it."""
    frames = tick_count(video, rate)
    duration = max(video.frame_count / video.info.frame_rate, (frames - 1) / rate)
    points = on_clock(_drawable_track(track, video.info), video.times_ns, rate)
    keyframes = keyframes_of(
        LabelledTrack(track.track, points),
        frame_count=frames + 1,  # they count from 1 here
        iou=options.iou,
        states=options.states,
        decimals=_PIXEL_DECIMALS,
    )
    if not keyframes:
        return None
    meta: dict[str, Any] = {"track_id": track.track.id}
    if track.track.attributes:
        meta["attributes"] = track.track.attributes
    return {
        "id": f"track-{track.track.id}",
        "type": "videorectangle",
        "from_name": "box",
        "to_name": "video",
        "score": _mean(track.in_states(options.states).values()),
        "meta": meta,
        "value": {
            "framesCount": frames,
            "duration": float(duration),
            "sequence": _sequence(keyframes, video.info, rate),
            "labels": [track.track.label],
        },
    }


def _check_length(video: LabelledVideo, rate: Fraction) -> None:
    frames = tick_count(video, rate)
    if frames > _MOST_FRAMES:
        raise VideoError(
            f"{video.info.path}: by the time of its last label, Label Studio would count {frames} "
            f"frames in it, more than {_MOST_FRAMES}; export to a format that counts pictures, "
            "such as cvat."
        )


def _task(video: LabelledVideo, options: ExportOptions) -> dict[str, Any]:
    rate = clock_rate(video)
    _check_length(video, rate)
    regions = [_region(track, video, rate, options) for track in video.tracks]
    points = (p for track in video.tracks for p in track.in_states(options.states).values())
    return {
        "data": {
            "video": f"/data/local-files/?d={quote(video.info.path.name)}",
            "fps": float(rate),
            ID_KEY: video.id,
        },
        "predictions": [
            {
                "model_version": "situp-annotate",
                "score": _mean(points),
                "result": [region for region in regions if region is not None],
            }
        ],
    }


def write_label_studio(
    videos: Iterable[LabelledVideo], folder: Path, options: ExportOptions
) -> None:
    """Write ``label_studio.json`` and ``label_config.xml``.

    Parameters
    ----------
    videos : iterable of LabelledVideo
        Taken one at a time; a task each.
    folder : Path
        Is there and empty.
    options : ExportOptions
        Which labels, and what the editor's interpolation has to overlap them by.

    Raises
    ------
    VideoError
        If times of labels are so far apart that there would be more than five million frames.
    """
    labels: set[str] = set()
    with (folder / _TASKS_FILE).open("w", encoding="utf-8", newline="\n") as file:
        separator = "["
        for video in videos:
            labels.update(track.track.label for track in video.tracks)
            task = json.dumps(_task(video, options), ensure_ascii=False, allow_nan=False)
            file.write(f"{separator}\n{task}")
            separator = ","
        file.write("[]\n" if separator == "[" else "\n]\n")
    lines = "".join(
        f"    <Label value={quoteattr(xml_text(label))}/>\n" for label in sorted(labels)
    )
    (folder / _CONFIG_FILE).write_text(_CONFIG.format(labels=lines), encoding="utf-8", newline="\n")
