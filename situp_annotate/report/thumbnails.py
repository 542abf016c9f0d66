"""Small pictures of a track: which frames get one, and how it is cut out, drawn and encoded."""

from base64 import b64encode
from collections.abc import Iterable, Sequence

import cv2
import numpy as np
import numpy.typing as npt

from situp_annotate.formats.appearance import track_color
from situp_annotate.formats.overlay.cropping import View
from situp_annotate.propagation import Suggestion, TrackLabels
from situp_annotate.types import Image, State, TrackPoint

__all__ = ["THUMBNAIL_SIZE", "plan_thumbnails", "thumbnail"]

THUMBNAIL_SIZE = (144, 108)
"""Width and height in pixels."""

_MOST = 420
"""Of a page."""
_MOST_BYTES = 1_000_000
"""All of a page together, before a third is added by writing them as text."""
_MOST_STEPS = 8
_SURROUNDINGS = 1.9
"""Width and height of what is shown, over the box's."""
_SMALLEST = 48.0
"""Pixels of the video across a thumbnail, at least: fewer tell nothing."""
_QUALITIES = (65, 45, 30, 15, 5)
"""Of JPEG, which takes a thirtieth of the time of WebP."""
_NOTHING = (128, 128, 128)
_DARK = (20, 20, 20)
_DASH = 5


def _labelled_frames(labels: TrackLabels) -> npt.NDArray[np.int64]:
    """Frames with a box, in order."""
    ranges = [np.arange(each.start, each.stop) for each in labels.stretches]
    return np.unique(np.concatenate(ranges)) if ranges else np.empty(0, np.int64)


def plan_thumbnails(
    tracks: Sequence[TrackLabels], suggestions: Iterable[Suggestion]
) -> dict[int, set[int]]:
    """Which tracks to show in which frames.

    Parameters
    ----------
    tracks : sequence of TrackLabels
        All tracks of the video.
    suggestions : iterable of Suggestion
        Best first: each gets a thumbnail, as long as the page does not grow too large.

    Returns
    -------
    dict of int to set of int
        Ids of tracks, by frame. Besides the suggestions these are regular steps through the
        frames in which a track has a box, at most eight.
    """
    chosen = [(each.frame, each.track_id) for each in suggestions][: _MOST * 3 // 4]
    steps = min(_MOST_STEPS, (_MOST - len(chosen)) // max(len(tracks), 1))
    for labels in tracks:
        frames = _labelled_frames(labels)
        count = min(steps, len(frames))
        places = (2 * np.arange(count) + 1) * len(frames) // (2 * max(count, 1))
        chosen += [(int(frame), labels.track.id) for frame in frames[places]]
    plan: dict[int, set[int]] = {}
    for frame, track_id in chosen:
        plan.setdefault(frame, set()).add(track_id)
    return plan


def _draw_box(canvas: Image, point: TrackPoint, view: View) -> None:
    """Outline the box, dashed unless the object is visible."""
    box = view.place(point.box)
    near, far = (round(box.x), round(box.y)), (round(box.right), round(box.bottom))
    cv2.rectangle(canvas, near, far, _DARK, 4)
    outline = np.zeros(canvas.shape[:2], np.uint8)
    cv2.rectangle(outline, near, far, 255, 2)
    if point.state is not State.VISIBLE:
        rows, columns = np.indices(outline.shape)
        outline[(rows + columns) // _DASH % 2 == 1] = 0
    canvas[outline > 0] = track_color(point.track_id)[::-1]


def thumbnail(image: Image, point: TrackPoint, *, of: int = 1) -> str:
    """Cut out a box and what surrounds it, and draw the box.

    Parameters
    ----------
    image : Image
        The whole picture; not changed.
    point : TrackPoint
        The box; dashed unless its state is visible.
    of : int
        Thumbnails on the page: with many, those rich in detail lose some of it.

    Returns
    -------
    str
        A JPEG picture as a ``data:`` address.
    """
    view = View.around(point.box, THUMBNAIL_SIZE[::-1], share=_SURROUNDINGS, smallest=_SMALLEST)
    canvas = view.cut_out(image, _NOTHING)
    _draw_box(canvas, point, view)
    encoded = b""
    for quality in _QUALITIES:
        encoded = cv2.imencode(".jpg", canvas, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()
        if len(encoded) <= _MOST_BYTES // of:
            break
    return "data:image/jpeg;base64," + b64encode(encoded).decode()
