"""One contract for every executor, and what only processes promise."""

import os
import signal

import pytest

from situp_annotate.errors import WorkerError
from situp_annotate.executors import ProcessExecutor, SerialExecutor, result_of

_greeting = ""


def greet(word):
    global _greeting
    _greeting = word


def greeting_and_pid():
    return _greeting, os.getpid()


def square(number):
    return number * number


def fail():
    raise ValueError("no")


def die(number):
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


@pytest.fixture(params=["serial", "process"])
def executor(request):
    made = SerialExecutor() if request.param == "serial" else ProcessExecutor(2, greet, ("hi",))
    with made:
        yield made


def test_results_and_exceptions_come_through_futures(executor):
    futures = [executor.submit(square, number) for number in range(4)]
    assert [result_of(future) for future in futures] == [0, 1, 4, 9]
    with pytest.raises(ValueError, match="no"):
        result_of(executor.submit(fail))


def test_each_call_has_a_process_of_its_own():
    with ProcessExecutor(2, greet, ("hi",)) as executor:
        seen = [result_of(executor.submit(greeting_and_pid)) for _ in range(3)]
    assert [word for word, _ in seen] == ["hi"] * 3
    assert len({os.getpid(), *(pid for _, pid in seen)}) == 4


def test_a_process_that_dies_takes_only_its_own_call_with_it():
    with ProcessExecutor(2, greet, ("hi",)) as executor:
        futures = [executor.submit(die, number) for number in range(4)]
        assert [result_of(futures[number]) for number in (0, 2, 3)] == [0, 2, 3]
        with pytest.raises(WorkerError, match="SIGKILL"):
            result_of(futures[1])
