"""Times of frames: whatever a stream says, they rise."""

from fractions import Fraction
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from situp_annotate.types import Finding
from situp_annotate.video.timeline import Timeline


def place_all(
    times_ns: list[int | None], *, from_stream: bool = True, regular: bool = True
) -> tuple[list[int], list[Finding]]:
    timeline = Timeline(
        frame_rate=Fraction(25), from_stream=from_stream, usual_step_ns=40, regular=regular
    )
    placed, findings = [], []
    for index, time_ns in enumerate(times_ns):
        own, odd = timeline.place(index, time_ns)
        placed.append(own)
        findings += odd
    return placed, findings


def test_good_times_are_kept() -> None:
    assert place_all([0, 40, 80, 120]) == ([0, 40, 80, 120], [])


def test_a_missing_time_takes_the_next_place() -> None:
    placed, findings = place_all([0, 40, None, 120])
    assert placed == [0, 40, 80, 120]
    assert [(found.kind, found.frame) for found in findings] == [("timestamps", 2)]


def test_a_double_time_is_moved_without_pushing_the_next() -> None:
    placed, findings = place_all([0, 40, 40, 80, 120])
    assert placed == [0, 40, 60, 80, 120]
    assert [(found.kind, found.frame) for found in findings] == [("timestamps", 2)]


def test_a_long_step_is_a_gap_only_where_steps_are_even() -> None:
    times: list[int | None] = [0, 40, 80, 240, 280]
    _, findings = place_all(times)
    assert [(found.kind, found.frame) for found in findings] == [("gap", 3)]
    assert "About 3 frames are missing" in findings[0].message
    assert place_all(times, regular=False)[1] == []


def test_time_starts_at_zero_even_where_pictures_come_before_the_start() -> None:
    assert place_all([-80, -40, 0, 40])[0] == [0, 40, 80, 120]
    assert place_all([80, 120])[0] == [80, 120]


def test_without_times_the_number_counts() -> None:
    placed, findings = place_all([None, 3, None], from_stream=False)
    assert placed == [0, 40_000_000, 80_000_000]
    assert findings == []


@given(st.lists(st.none() | st.integers(-(10**12), 10**12), min_size=1, max_size=50))
def test_times_always_rise(times_ns: list[int | None]) -> None:
    placed, _ = place_all(times_ns)
    assert placed[0] >= 0
    assert all(later > earlier for earlier, later in pairwise(placed))
