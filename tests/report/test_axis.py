"""Times under a strip and in a page: exact, whatever the frame rate."""

from itertools import accumulate

from hypothesis import given
from hypothesis import strategies as st

from situp_annotate.report.axis import place_of, step_runs, ticks_of
from situp_annotate.types import NS_PER_S
from situp_annotate.video.x264 import ticks


def test_a_constant_frame_rate_is_one_run():
    times = [round(n * 1001 * NS_PER_S / 30000) for n in range(18_000)]
    assert step_runs(times) == {"first": 0, "steps": [(3003, 17_999)]}


@given(st.lists(st.integers(1, 10**10), min_size=1, max_size=60))
def test_times_come_back_to_the_tick(steps_ns):
    times = list(accumulate(steps_ns))
    packed = step_runs(times)
    steps = [step for step, count in packed["steps"] for _ in range(count)]
    assert list(accumulate([packed["first"], *steps])) == [ticks(time) for time in times]


def test_no_frames():
    assert step_runs([]) == {"first": 0, "steps": []}
    assert ticks_of([]) == []


def test_ticks_are_round_and_few():
    times = [n * NS_PER_S // 30 for n in range(240)]
    texts = [tick.text for tick in ticks_of(times)]
    assert texts == ["0:00", "0:02", "0:04", "0:06"]
    assert ticks_of(times)[1].place == place_of(60, 240)
    hours = ticks_of([n * NS_PER_S for n in range(7 * 3600)])
    assert [tick.text for tick in hours][-1] == "6:00:00"
    short = ticks_of([n * NS_PER_S // 30 for n in range(20)])
    assert [tick.text for tick in short][:3] == ["0.0 s", "0.1 s", "0.2 s"]


def test_ticks_stand_at_the_first_frame_at_or_after_their_time():
    gap = [0, NS_PER_S, 9 * NS_PER_S, 10 * NS_PER_S]
    places = {tick.text: tick.place for tick in ticks_of(gap)}
    assert places["0:02"] == places["0:08"] == place_of(2, 4)


def test_a_late_start_has_no_ticks_before_it():
    late = [100 * NS_PER_S + n * NS_PER_S for n in range(10)]
    assert [tick.text for tick in ticks_of(late)] == ["1:40", "1:42", "1:44", "1:46", "1:48"]
