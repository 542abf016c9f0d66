"""Thumbnails: which frames have one, and that they show the box and the picture around it."""

from base64 import b64decode

import cv2
import numpy as np
import pytest
from support.reports import linear_labels, linear_track

from situp_annotate.formats.appearance import track_color
from situp_annotate.propagation import Reason, Suggestion
from situp_annotate.report.thumbnails import THUMBNAIL_SIZE, plan_thumbnails, thumbnail
from situp_annotate.types import BoundingBox, Provenance, State, TrackPoint

WIDTH, HEIGHT = THUMBNAIL_SIZE


def point_at(box, state=State.VISIBLE):
    return TrackPoint(1, box, 0.5, state, Provenance.TRACKED)


def decoded(address):
    kind, _, content = address.partition(",")
    assert kind == "data:image/jpeg;base64"
    picture = cv2.imdecode(np.frombuffer(b64decode(content), np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (HEIGHT, WIDTH, 3)
    return picture.astype(int)


def edge_share(picture, left, top, right, bottom):
    """Share of a rectangle's outline that is in the track's colour."""
    color = np.array(track_color(1)[::-1])
    rows = [picture[[top, bottom], left:right].reshape(-1, 3)]
    columns = [picture[top:bottom, [left, right]].reshape(-1, 3)]
    edge = np.concatenate(rows + columns)
    return np.mean(np.abs(edge - color).max(axis=1) < 90)


@pytest.mark.parametrize("channels", [1, 3])
def test_the_box_is_in_the_middle_and_the_picture_around_it(channels):
    image = np.full((600, 800, 3), 200, np.uint8)
    image[280:320, 380:420] = 30
    if channels == 1:
        image = image[..., 0]
    picture = decoded(thumbnail(image, point_at(BoundingBox(360, 270, 80, 60))))
    scale = WIDTH / (1.9 * 80)
    left, top = round(WIDTH / 2 - 40 * scale), round(HEIGHT / 2 - 30 * scale)
    assert edge_share(picture, left, top, WIDTH - left, HEIGHT - top) > 0.7
    assert picture[HEIGHT // 2, WIDTH // 2].max() < 60
    assert picture[5, 5].min() > 170


def test_boxes_that_are_not_visible_are_dashed():
    image = np.full((600, 800, 3), 200, np.uint8)
    box = BoundingBox(360, 270, 80, 60)
    scale = WIDTH / (1.9 * 80)
    left, top = round(WIDTH / 2 - 40 * scale), round(HEIGHT / 2 - 30 * scale)
    share = edge_share(
        decoded(thumbnail(image, point_at(box, State.LOST))),
        left, top, WIDTH - left, HEIGHT - top,
    )  # fmt: skip
    assert 0.2 < share < 0.75


@pytest.mark.parametrize(
    "box",
    [
        BoundingBox(-30, -20, 60, 40),
        BoundingBox(780, 590, 60, 40),
        BoundingBox(-500, -500, 20, 20),
        BoundingBox(5000, 5000, 20, 20),
        BoundingBox(0, 0, 100_000, 3),
        BoundingBox(400, 300, 0.001, 0.001),
        BoundingBox(400, 300, 1, 4000),
    ],
)
def test_boxes_anywhere_and_of_any_size(box):
    image = np.full((600, 800, 3), 200, np.uint8)
    before = image.copy()
    decoded(thumbnail(image, point_at(box)))
    assert (image == before).all()


def test_many_rich_pictures_take_no_more_than_their_share():
    image = np.random.default_rng(0).integers(0, 256, (600, 800, 3), dtype=np.uint8)
    box = BoundingBox(360, 270, 80, 60)
    assert len(thumbnail(image, point_at(box))) > 8000
    assert len(thumbnail(image, point_at(box), of=420)) < 4200


def test_beyond_the_edge_it_is_grey():
    image = np.full((600, 800, 3), 240, np.uint8)
    picture = decoded(thumbnail(image, point_at(BoundingBox(-30, 270, 60, 60))))
    assert abs(picture[5, 5] - 128).max() < 16
    assert picture[5, -5].min() > 220


def test_suggestions_and_regular_steps_are_shown():
    labels = linear_labels([linear_track(1, [0, 79]), linear_track(2, [60, 79])], 80)
    suggestion = Suggestion(1, 33, Reason.CONFIDENCE, 0.5, 3.0)
    plan = plan_thumbnails(labels.tracks, [suggestion])
    frames = {track: sorted(n for n, ids in plan.items() if track in ids) for track in (1, 2)}
    assert frames[1] == [5, 15, 25, 33, 35, 45, 55, 65, 75]
    assert len(frames[2]) == 8
    assert min(frames[2]) >= 60


def test_a_page_has_room_for_some_hundred():
    tracks = [linear_track(n, [0, 99]) for n in range(1, 301)]
    suggestions = [
        Suggestion(track.id, n, Reason.LOST, 0.1, 100.0 - n) for n in range(10) for track in tracks
    ]
    plan = plan_thumbnails(linear_labels(tracks, 100).tracks, suggestions)
    shown = sum(len(ids) for ids in plan.values())
    assert 300 <= shown <= 420
    assert {(n, 1) for n in [0]} <= {(n, id_) for n, ids in plan.items() for id_ in ids}


def test_nothing_to_show():
    assert plan_thumbnails([], []) == {}
    assert plan_thumbnails(linear_labels([linear_track(1, [99])], 10).tracks, []) == {}
