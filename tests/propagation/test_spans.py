"""Which stretches are tracked from where, and boxes drawn between keyframes."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from support.sliding import BOX, OTHER

from situp_annotate.propagation.interpolation import interpolate
from situp_annotate.propagation.spans import backward_passes, forward_passes, runs, spans
from situp_annotate.types import BoundingBox, Keyframe, Method

A, B, GONE, C = Keyframe(2, BOX), Keyframe(6, OTHER), Keyframe(9, None), Keyframe(12, BOX)


def test_forward_passes_go_into_the_next_box_or_to_where_the_object_leaves():
    passes = forward_passes([A, B, GONE, C])
    assert [(key.frame, key.last, key.open) for key in passes] == [
        (2, 6, False), (6, 8, True), (12, None, True),
    ]  # fmt: skip


def test_backward_passes_join_neighbouring_boxes():
    assert [(k.frame, k.last, k.open) for k in backward_passes([A, B, GONE, C], extend=False)] == [
        (6, 2, False)
    ]
    extended = backward_passes([A, B], extend=True)
    assert [(key.frame, key.last, key.open) for key in extended] == [(6, 2, False), (2, 0, True)]
    assert all(key.is_backward for key in extended)


def test_spans_cover_every_frame_that_has_a_box():
    found = spans([A, B, GONE, C], 20, extend=False)
    assert [(span.start, span.stop) for span in found] == [(2, 7), (6, 9), (12, 20)]
    assert spans([A], 20, extend=True)[0].start == 0
    assert spans([], 20, extend=True) == []


def test_runs_are_parted_where_the_object_is_outside():
    assert runs([A, B, GONE, C]) == [[A, B], [C]]


def drawn(method, *keyframes, start=0, stop=10):
    return interpolate(keyframes, method, start, stop)[:, 0]


def test_interpolation_by_hand():
    first, last = Keyframe(2, BoundingBox(0, 0, 4, 4)), Keyframe(6, BoundingBox(8, 0, 4, 4))
    assert drawn(Method.LINEAR, first, last).tolist() == [0, 0, 0, 2, 4, 6, 8, 8, 8, 8]
    assert drawn(Method.HOLD, first, last).tolist() == [0, 0, 0, 0, 0, 0, 8, 8, 8, 8]
    assert drawn(Method.CUBIC, first).tolist() == [0] * 10


@given(st.lists(st.floats(-100, 100), min_size=2, max_size=6))
@example([0.0, 0.0, 2.225073858507e-311])
def test_cubic_interpolation_meets_the_boxes_and_never_overshoots(corners):
    keyframes = [Keyframe(5 * n, BoundingBox(x, 0, 4, 4)) for n, x in enumerate(corners)]
    x = drawn(Method.CUBIC, *keyframes, stop=5 * len(corners) - 4)
    assert x[::5] == pytest.approx(corners)
    assert x.min() >= min(corners) - 1e-9
    assert x.max() <= max(corners) + 1e-9
    assert np.isfinite(x).all()
