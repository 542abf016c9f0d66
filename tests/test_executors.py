"""One contract for every executor, and what only processes promise."""

import os

import pytest
from support.calls import die, fail, fail_to_start, greet, greeting_and_pid, square

from situp_annotate.errors import WorkerError
from situp_annotate.executors import ProcessExecutor, SerialExecutor, result_of


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


def test_processes_that_cannot_start_are_an_error_and_no_hang():
    with (
        ProcessExecutor(1, fail_to_start, ()) as executor,
        pytest.raises(WorkerError, match=r"could be started|died"),
    ):
        result_of(executor.submit(square, 2))
