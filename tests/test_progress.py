"""Frames counted by many, summed up by one."""

from situp_annotate.progress import BatchProgress, FrameCounters


def test_nothing_known_yet():
    assert FrameCounters(3).progress([False] * 3) == BatchProgress(0, 3, 0, 0)


def test_an_empty_batch():
    assert FrameCounters(0).progress([]) == BatchProgress(0, 0, 0, 0)


def test_what_is_not_known_is_taken_for_the_mean_of_what_is():
    counters = FrameCounters(3)
    counters.report(0, 100, 150)  # finished: the header promised too much
    counters.report(1, 40, 200)
    assert counters.progress([True, False, False]) == BatchProgress(1, 3, 140, 100 + 200 + 150)


def test_a_header_that_promised_too_little():
    counters = FrameCounters(1)
    counters.report(0, 40, None)
    counters.report(0, 41, 12)
    assert counters.progress([False]) == BatchProgress(0, 1, 41, 41)
