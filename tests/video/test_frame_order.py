"""Which packet a frame comes from: whatever became of the times, it is found again."""

from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st

from situp_annotate.video.frame_order import FrameFollower, FrameOrder
from situp_annotate.video.timeline import Timeline

MS = 1_000_000


def forward(times_ns: list[int | None], *, from_stream: bool = True) -> list[int]:
    timeline = Timeline(
        frame_rate=Fraction(25), from_stream=from_stream, usual_step_ns=40 * MS, regular=True
    )
    return [timeline.place(index, time_ns)[0] for index, time_ns in enumerate(times_ns)]


def order_of(times_ns: list[int], packets_ns: list[int | None], first: int = 0) -> list[int | None]:
    order = FrameOrder.by_times(times_ns, packets_ns, first=first)
    return [order.index_of(number) for number in range(len(packets_ns))]


def follow(times_ns: list[int], own_ns: list[int | None]) -> list[int | None]:
    follower = FrameFollower(times_ns, from_stream=True)
    return [follower.place(time_ns) for time_ns in own_ns]


def test_packets_are_found_by_time_though_they_are_stored_in_another_order() -> None:
    assert order_of([0, 40 * MS, 80 * MS, 120 * MS], [0, 120 * MS, 40 * MS, 80 * MS]) == [
        0,
        3,
        1,
        2,
    ]


def test_floating_point_milliseconds_are_matched() -> None:
    assert order_of([0, 33_333_334, 66_666_666], [0, 33_333_333, 66_666_667]) == [0, 1, 2]


def test_packets_without_a_frame_are_left_out() -> None:
    assert order_of([0, 80 * MS], [0, 40 * MS, 80 * MS, None]) == [0, None, 1, None]


def test_pictures_before_the_start_shift_all_times() -> None:
    # The packet at -80 ms gave no frame: the first frame, at -40 ms, is at 0.
    packets: list[int | None] = [-80 * MS, -40 * MS, 0, 40 * MS]
    assert order_of([0, 40 * MS, 80 * MS], packets, first=1) == [None, 0, 1, 2]
    assert order_of([0, 40 * MS], packets, first=1) == [None, 0, 1, None]


def test_nothing_is_surmised_where_a_time_was_moved_or_is_double() -> None:
    nothing = [None, None, None]
    assert order_of([0, 40 * MS, 60 * MS], [0, 40 * MS, 40 * MS]) == nothing
    assert order_of([0, 40 * MS, 80 * MS], [0, 40 * MS, 120 * MS]) == nothing
    assert order_of([40 * MS, 80 * MS], [0, 40 * MS, 80 * MS], first=0) == nothing
    assert FrameOrder.by_times([0, 1], [0], first=0).known == 0


def test_an_unknown_packet_has_no_index() -> None:
    order = FrameOrder(2)
    order.record(0, None)
    order.record(1, 7)
    assert order.known == 2
    assert [order.index_of(number) for number in (None, -1, 0, 1, 7)] == [None] * 5


def test_pictures_that_only_one_pass_has_are_told_by_their_times() -> None:
    times_ns = [0, 40 * MS, 120 * MS, 160 * MS]
    # 80 ms was not there in reading forward; 120 ms does not come now.
    assert follow(times_ns, [0, 40 * MS, 80 * MS, 160 * MS, 200 * MS]) == [0, 1, None, 3, None]


def test_without_usable_times_pictures_are_counted() -> None:
    follower = FrameFollower(forward([None] * 3, from_stream=False), from_stream=False)
    assert [follower.place(time_ns) for time_ns in (5, None, 3, None)] == [0, 1, 2, None]


@given(
    st.lists(st.none() | st.integers(-100, 1000).map(lambda ms: ms * MS), min_size=1, max_size=50)
)
def test_every_picture_of_the_same_stream_is_found(own_ns: list[int | None]) -> None:
    assert follow(forward(own_ns), own_ns) == list(range(len(own_ns)))
