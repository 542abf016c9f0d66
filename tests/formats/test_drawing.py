"""What is drawn, looked at pixel by pixel where it can be known."""

import cv2
import numpy as np
import pytest

from situp_annotate.formats.appearance import caption, track_color
from situp_annotate.formats.overlay.drawing import draw_labels
from situp_annotate.types import BoundingBox, Keyframe, Provenance, State, Track, TrackPoint

GREY = 90


def label(track_id, box, *, human=False, state=State.VISIBLE, name="thing"):
    track = Track(track_id, name, (Keyframe(0, box),))
    provenance = Provenance.HUMAN if human else Provenance.TRACKED
    return track, TrackPoint(track_id, box, 0.5, state, provenance)


def plain(height=240, width=320, channels=3):
    return np.full((height, width, channels) if channels else (height, width), GREY, np.uint8)


def drawn(image, *labels):
    """Where `draw_labels` changed the picture, below the tag and above the frame's number."""
    result = draw_labels(image, 7, labels)
    bare = draw_labels(image, 7, [])
    return (result != bare).any(axis=2)


def test_outline_lies_on_the_box_in_the_tracks_colour():
    image = plain()
    result = draw_labels(image, 7, [label(4, BoundingBox(100, 100, 80, 60))])
    blue_green_red = track_color(4)[::-1]
    assert tuple(result[130, 100]) == blue_green_red  # left edge: first column inside
    assert tuple(result[130, 179]) == blue_green_red  # right edge: last column inside
    assert tuple(result[159, 140]) == blue_green_red  # bottom edge
    assert (result[105:155, 105:175] == GREY).all()  # the object itself stays visible


def test_the_picture_is_not_drawn_into():
    image = plain()
    draw_labels(image, 0, [label(1, BoundingBox(10, 10, 50, 50))])
    assert (image == GREY).all()


def test_grey_pictures_become_colour():
    assert draw_labels(plain(channels=0), 0, []).shape == (240, 320, 3)


def test_keyframes_have_handles():
    box = BoundingBox(100, 100, 80, 60)
    plainly, marked = drawn(plain(), label(1, box)), drawn(plain(), label(1, box, human=True))
    assert not plainly[163, 180 + 2]
    assert marked[162, 182]


def test_occluded_boxes_are_dashed():
    box = BoundingBox(100, 100, 80, 60)
    solid = drawn(plain(), label(1, box))
    dashed = drawn(plain(), label(1, box, state=State.OCCLUDED))
    assert solid[159, 105:175].all()
    assert 0.2 < dashed[159, 105:175].mean() < 0.8


def test_lost_boxes_are_dashed_and_dimmed():
    box = BoundingBox(100, 100, 80, 60)
    occluded, lost = (
        draw_labels(plain(), 7, [label(1, box, state=state)])[159, 105:175].astype(int)
        for state in (State.OCCLUDED, State.LOST)
    )
    assert ((occluded != GREY).any(axis=1) == (lost != GREY).any(axis=1)).all()
    assert lost[lost != GREY].mean() < 0.75 * occluded[occluded != GREY].mean()


@pytest.mark.parametrize("size", [(240, 320), (720, 1280), (2160, 3840)])
def test_tags_grow_with_the_picture(size):
    height, width = size
    changed = drawn(
        plain(*size), label(1, BoundingBox(width / 2, height / 2, width / 4, height / 4))
    )
    above = changed[: height // 2 - height // 100].any(axis=1).sum()
    assert 1 / 40 <= above / height <= 1 / 14


@pytest.mark.parametrize(
    "box",
    [(-50, -50, 60, 60), (310, 230, 100, 100), (0, 0, 320, 240), (5, 5, 0.2, 0.2), (-900, 50, 9, 9),
     (50, 1e7, 10, 10), (-4e8, -4e8, 1e9, 1e9), (160, -20, 40, 40), (300, 100, 15, 20)],
)  # fmt: skip
@pytest.mark.parametrize(
    "style", [{}, {"human": True}, {"state": State.OCCLUDED}, {"state": State.LOST}]
)
def test_no_box_is_too_odd(box, style):
    result = draw_labels(plain(), 0, [label(1, BoundingBox(*box), **style)])
    assert result.shape == (240, 320, 3)


@pytest.mark.parametrize("name", ["x" * 200, "Fußgänger", "歩行者", "a\nb", " "])
@pytest.mark.parametrize("size", [(1, 1), (8, 8), (240, 320)])
def test_no_label_and_no_picture_is_too_odd(name, size):
    result = draw_labels(plain(*size), 0, [label(1, BoundingBox(0, 0, 5, 5), name=name)])
    assert result.shape == (*size, 3)


def test_colours_are_stable_and_apart():
    colours = [np.array(track_color(number), float) for number in range(1, 9)]
    assert track_color(1) == track_color(1)
    apart = [np.abs(a - b).max() for i, a in enumerate(colours) for b in colours[:i]]
    assert min(apart) > 60


def test_caption():
    box = BoundingBox(0, 0, 5, 5)
    assert caption(*label(3, box, name="car")) == "#3 car 0.50"
    assert caption(*label(3, box, name="car", human=True)) == "#3 car key"
    assert caption(*label(3, box, name="car", state=State.LOST)) == "#3 car 0.50 lost"


@pytest.mark.skipif(not hasattr(cv2, "FontFace"), reason="OpenCV 4 has no font for more")
def test_letters_beyond_ascii_differ():
    box = BoundingBox(20, 60, 50, 50)
    first, second = (draw_labels(plain(), 0, [label(1, box, name=name)]) for name in ("ä", "ß"))
    assert (first != second).any()
