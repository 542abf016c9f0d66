"""A contact sheet: one track at a glance, crops of its object in rows."""

from dataclasses import replace

import numpy as np

from situp_annotate.formats.labelled import LabelledTrack
from situp_annotate.formats.overlay.cropping import View
from situp_annotate.formats.overlay.drawing import draw_labels
from situp_annotate.formats.overlay.text import DARK, Color, paste, text_tag
from situp_annotate.types import (
    NS_PER_S,
    Frame,
    Image,
    Provenance,
    State,
    Track,
    TrackPoint,
)

__all__ = ["ContactSheet"]

_COLUMNS = 6
_CROP_HW = (144, 192)
_AROUND = 2.0
"""Side of what a crop shows over the side of the box, in the tighter direction."""
_SMALLEST = 24.0
"""Pixels of the video across a crop, at least: fewer tell nothing."""
_BORDER = 4
_MARGIN = 6
_FONT = 14
_TITLE_FONT = 20
_LINE_HEIGHT = round(1.25 * _FONT)
_CELL_HW = (_CROP_HW[0] + 2 * _BORDER + 2 * _LINE_HEIGHT, _CROP_HW[1] + 2 * _BORDER)

_STATE_COLORS: dict[State, Color] = {
    State.VISIBLE: (80, 160, 60),
    State.OCCLUDED: (30, 150, 240),
    State.LOST: (50, 50, 220),
}


class ContactSheet:
    """Gathers the crops of one track and lays them out.

    Parameters
    ----------
    video_id : str
        Stands in the title.
    labelled : LabelledTrack
        The track and its labels.
    steps : int
        Crops at regular steps, at most; those that a person drew come on top, thinned out
        where there are more than so many.

    Attributes
    ----------
    frames : frozenset of int
        Frames that are to be added.
    """

    def __init__(self, video_id: str, labelled: LabelledTrack, *, steps: int) -> None:
        self._track = labelled.track
        self._points = labelled.points
        self._title = _title(video_id, labelled)
        drawn = [f for f, p in labelled.points.items() if p.provenance is Provenance.HUMAN]
        self.frames = frozenset(_spread([*labelled.points], steps) + _spread(drawn, steps))
        self._cells: list[Image] = []

    def add(self, frame: Frame) -> None:
        """Add a frame; frames come in order."""
        self._cells.append(_cell(frame, self._track, self._points[frame.index]))

    def image(self) -> Image:
        """The sheet, (height, width, 3), in the order B, G, R."""
        title = text_tag(self._title, _TITLE_FONT, DARK)
        height, width = (side + _MARGIN for side in _CELL_HW)
        columns = min(_COLUMNS, len(self._cells))
        rows = -(-len(self._cells) // _COLUMNS)
        top = title.shape[0] + 2 * _MARGIN
        sheet_width = _MARGIN + max(columns * width, title.shape[1] + _MARGIN)
        sheet = np.full((top + rows * height, sheet_width, 3), DARK, np.uint8)
        paste(sheet, title, (_MARGIN, _MARGIN))
        for number, cell in enumerate(self._cells):
            row, column = divmod(number, _COLUMNS)
            paste(sheet, cell, (_MARGIN + column * width, top + row * height))
        return sheet


def _spread(frames: list[int], count: int) -> list[int]:
    """So many of the frames, evenly spread, the first and the last among them."""
    if len(frames) <= count:
        return frames
    places = np.linspace(0, len(frames) - 1, count).round().astype(int)
    return [frames[place] for place in places]


def _title(video_id: str, labelled: LabelledTrack) -> str:
    points = labelled.points
    name = f"{video_id}, track {labelled.track.id} ({labelled.track.label})"
    if not points:
        return f"{name}: no boxes"
    states = [point.state for point in points.values()]
    counts = ", ".join(f"{states.count(state)} {state}" for state in State if state in states)
    drawn = sum(point.provenance is Provenance.HUMAN for point in points.values())
    frames = f"frames {min(points)} to {max(points)}"
    return f"{name}: {len(points)} boxes, {frames}, {drawn} drawn by hand, {counts}"


def _cell(frame: Frame, track: Track, point: TrackPoint) -> Image:
    color = _STATE_COLORS[point.state]
    cell = np.full((*_CELL_HW, 3), color, np.uint8)
    paste(cell, _crop(frame.image, track, point), (_BORDER, _BORDER))
    trust = "key" if point.provenance is Provenance.HUMAN else f"{point.confidence:.2f}"
    top = _CROP_HW[0] + 2 * _BORDER
    for line in (
        f"frame {frame.index}  {frame.pts_ns / NS_PER_S:.2f} s",
        f"{trust}  {point.state}",
    ):
        paste(cell, text_tag(line, _FONT, color, margin=_BORDER), (0, top))
        top += _LINE_HEIGHT
    return cell


def _crop(image: Image, track: Track, point: TrackPoint) -> Image:
    """The box and its surroundings, in the size of a crop; dark outside the picture."""
    view = View.around(point.box, _CROP_HW, share=_AROUND, smallest=_SMALLEST)
    moved = replace(point, box=view.place(point.box))
    return draw_labels(view.cut_out(image, DARK), 0, [(track, moved)], captions="none")
