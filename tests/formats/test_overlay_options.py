"""What an overlay may show, and what is refused."""

import pytest

from situp_annotate.errors import RecipeError
from situp_annotate.formats.overlay.options import OverlayOptions
from situp_annotate.types import BoundingBox, Keyframe, Track

TRACKS = [
    Track(number, label, (Keyframe(0, BoundingBox(0, 0, 1, 1)),))
    for number, label in ((1, "car"), (2, "van"), (7, "car"))
]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"captions": "big"}, "captions = 'big' is not allowed: give one of full, id, none"),
        ({"preset": "placebo"}, "preset = 'placebo' is not allowed"),
        ({"trails": -0.1}, "trails = -0.1 is not allowed: give seconds, 0 or more"),
        ({"trails": float("nan")}, "trails = nan"),
        ({"context": float("inf")}, "context = inf"),
        ({"below": 1.01}, "below = 1.01 is not allowed: give from 0 to 1"),
        ({"max_height": 15}, "max_height = 15 is not allowed: give 0, or at least 16"),
        ({"max_height": -1}, "max_height = -1"),
        ({"crf": 52}, "crf = 52 is not allowed: give from 1 to 51"),
    ],
)
def test_bad_values_are_refused(values, words):
    with pytest.raises(RecipeError) as caught:
        OverlayOptions(**values)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("chosen", "ids"),
    [((), [1, 2, 7]), ((2,), [2]), (("car",), [1, 7]), ((2, "car"), [1, 2, 7]), (("bus",), [])],
)
def test_tracks_are_chosen_by_id_or_label(chosen, ids):
    assert [track.id for track in OverlayOptions(tracks=chosen).shown(TRACKS)] == ids


@pytest.mark.parametrize(
    ("limit", "size_hw"), [(0, (1080, 1920)), (1080, (1080, 1920)), (2000, (1080, 1920)),
                           (720, (720, 1280)), (16, (16, 28))],
)  # fmt: skip
def test_large_pictures_are_made_smaller(limit, size_hw):
    assert OverlayOptions(max_height=limit).size_hw(1080, 1920) == size_hw
