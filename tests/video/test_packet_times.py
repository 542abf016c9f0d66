"""Figures over packet times, with answers known by construction."""

import random
import tracemalloc
from fractions import Fraction

import pytest

from situp_annotate.video.packet_times import PacketTimes


def times_of(pts: list[int | None], dts: list[int | None] | None = None) -> PacketTimes:
    times = PacketTimes()
    for k, value in enumerate(pts):
        times.add(value, dts[k] if dts else None, 10)
    times.finish()
    return times


def reordered(count: int) -> list[int | None]:
    """Times in decode order, with two B-frames after each P-frame."""
    pts: list[int | None] = [0]
    for group in range(1, count, 3):
        pts += [10 * (group + 2), 10 * group, 10 * (group + 1)]
    return pts


def test_reordered_times_are_in_order() -> None:
    times = times_of(reordered(90))
    assert times.usable
    assert times.flaws == 0
    assert times.regular
    assert times.usual_step == 10
    assert (times.first, times.last, times.end) == (0, 900, 910)
    assert times.pictures_per_tick == Fraction(1, 10)


def test_a_few_flaws_are_forgiven_and_many_are_not() -> None:
    assert times_of([0, 10, 20, None, 40, 50]).usable
    assert times_of([0, 10, 20, 20, 30, 40]).usable
    assert times_of([0, None, None, 30, 40, 50]).usable
    assert not times_of([0, None, None, 30]).usable
    assert not times_of([0, None, None, None, None, *range(50, 500, 10)]).usable
    assert not times_of([None] * 10).usable
    assert not times_of([*range(100), *range(100)]).usable, "a clock that starts again"
    assert not times_of([]).usable


def test_a_hole_leaves_the_stream_regular_and_its_usual_step() -> None:
    times = times_of([10 * k + 140 * (k > 30) for k in range(60)])
    assert times.regular
    assert times.usual_step == 10


def test_millisecond_rounding_is_regular() -> None:
    assert times_of([round(k * 1000 / 30) for k in range(90)]).regular
    assert times_of([round(k * 1000 / 240) for k in range(90)]).regular


@pytest.mark.parametrize("choices", [(2, 3, 4, 7), (20, 30), (10, 100)])
def test_a_variable_rate_is_not_regular(choices: tuple[int, ...]) -> None:
    rng = random.Random(1)
    pts: list[int | None] = [0]
    for _ in range(200):
        pts.append((pts[-1] or 0) + rng.choice(choices) * 10)
    assert not times_of(pts).regular


def test_without_presentation_times_the_rate_comes_from_decoding_times() -> None:
    nothing: list[int | None] = [None] * 31
    assert times_of(nothing, [20 * k for k in range(31)]).pictures_per_tick == Fraction(1, 20)
    assert times_of(nothing).pictures_per_tick is None
    assert times_of([5]).pictures_per_tick is None


def test_memory_does_not_grow_with_the_stream() -> None:
    rng = random.Random(1)
    times = PacketTimes()
    tracemalloc.start()
    pts = 0
    for _ in range(20_000):
        pts += rng.randrange(1, 100_000)
        times.add(pts, pts, 1)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert times.count == 20_000
    assert not times.regular
    assert peak < 300_000
