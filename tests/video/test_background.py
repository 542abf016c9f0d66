"""Calls in the background: in order, bounded, and their errors told."""

import threading

import pytest

from situp_annotate.video.background import Background


def test_calls_are_made_in_order_in_another_thread():
    seen = []
    background = Background(lambda number: seen.append((number, threading.get_ident())))
    for number in range(50):
        background(number)
    background.finish()
    background.close()
    assert [number for number, _ in seen] == list(range(50))
    assert {thread for _, thread in seen}.isdisjoint({threading.get_ident()})


def test_a_caller_does_not_run_away():
    go, seen = threading.Event(), []

    def slow(number):
        assert go.wait(10)
        seen.append(number)

    background = Background(slow)
    for number in range(4):
        background(number)
    threading.Timer(0.1, go.set).start()
    background(4)  # waits for the first
    assert seen[0] == 0
    background.finish()
    background.close()
    assert seen == [0, 1, 2, 3, 4]


def fail_at_3(number):
    if number == 3:
        raise ArithmeticError("the third")


def test_an_error_comes_out_of_a_later_call_and_is_the_last():
    called = []

    def note(number):
        called.append(number)
        fail_at_3(number)

    background = Background(note)
    with pytest.raises(ArithmeticError, match="the third"):
        for number in range(100):
            background(number)
    background.close()
    assert number < 10
    assert called == [0, 1, 2, 3]


def test_an_error_comes_out_of_finish():
    background = Background(fail_at_3)
    background(3)
    with pytest.raises(ArithmeticError):
        background.finish()
    background.close()


def test_closing_forgets_what_is_waiting():
    before = threading.active_count()
    begun, go, seen = threading.Event(), threading.Event(), []

    def slow(number):
        begun.set()
        assert go.wait(10)
        seen.append(number)

    background = Background(slow)
    for number in range(4):
        background(number)
    assert begun.wait(10)
    threading.Timer(0.1, go.set).start()
    background.close()
    assert seen == [0]
    assert threading.active_count() == before
