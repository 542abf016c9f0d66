"""One contract for every executor, and what only processes promise."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import CancelledError
from pathlib import Path

import psutil
import pytest
from support import calls
from support.calls import (
    crash,
    die,
    end_politely,
    fail,
    hang,
    pid_of,
    report_pid,
    slow_steps,
    square,
)

from situp_annotate.batch import annotate_batch
from situp_annotate.errors import (
    VideoStalledError,
    VideoTimeoutError,
    WorkerError,
    WorkerKilledError,
)
from situp_annotate.executors import CallLimits, ProcessExecutor, SerialExecutor


@pytest.fixture
def short_folder():
    """One whose path leaves room for that of a socket, as those of pytest do not always."""
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


@pytest.fixture(params=["serial", "process"])
def executor(request):
    made = SerialExecutor() if request.param == "serial" else ProcessExecutor(2)
    with made:
        yield made


def test_results_and_exceptions_come_through_futures(executor):
    futures = [executor.submit(square, number) for number in range(4)]
    assert [future.result() for future in futures] == [0, 1, 4, 9]
    with pytest.raises(ValueError, match="no"):
        executor.submit(fail).result()


def test_short_calls_may_share_a_process():
    with ProcessExecutor(1, shared_for_s=60) as executor:
        futures = [executor.submit(pid_of) for _ in range(4)]
        pid = futures[0].result()
        assert [future.result() for future in futures] == [pid] * 4 != [os.getpid()] * 4
    assert not psutil.pid_exists(pid)


def test_each_call_has_a_process_of_its_own():
    with ProcessExecutor(2) as executor:
        futures = [executor.submit(pid_of) for _ in range(4)]
    assert len({os.getpid(), *(future.result() for future in futures)}) == 5


def test_a_call_does_not_suffer_from_what_an_earlier_one_has_done(tmp_path):
    with ProcessExecutor(1, shared_for_s=60) as executor:
        futures = [executor.submit(calls.crash_unless_first, tmp_path / "0") for _ in range(3)]
        pids = [future.result() for future in futures]
    assert len({*pids}) == 3  # each but the first is made again in a process that is fresh


def test_an_idle_process_may_be_killed():
    with ProcessExecutor(1, shared_for_s=60) as executor:
        os.kill(executor.submit(pid_of).result(), signal.SIGKILL)
        assert executor.submit(square, 3).result() == 9


def test_processes_know_nothing_of_what_their_parent_has_done():
    calls.mark = "set"
    with ProcessExecutor(1) as executor:
        assert executor.submit(calls.read_mark).result() == "not set"


@pytest.mark.parametrize(
    ("call", "error", "said"),
    [
        (die, WorkerKilledError, r"SIGKILL\), by the system for want of memory"),
        (end_politely, WorkerKilledError, "SIGTERM"),
        (crash, WorkerError, "SIGSEGV"),
    ],
)
def test_a_process_that_dies_takes_only_its_own_call_with_it(call, error, said):
    with ProcessExecutor(2) as executor:
        before, dead, after = (executor.submit(each, 2) for each in (square, call, square))
        with pytest.raises(error, match=said) as caught:
            dead.result()
        assert type(caught.value) is error
        assert before.result() == after.result() == 4


def test_a_call_that_takes_too_long_is_stopped(tmp_path):
    with ProcessExecutor(1, CallLimits(timeout_s=5)) as executor:
        future = executor.submit(hang, tmp_path / "pid")
        with pytest.raises(VideoTimeoutError, match="longer than the 5 s"):
            future.result()
        assert executor.submit(square, 3).result() == 9
    assert not psutil.pid_exists(int((tmp_path / "pid").read_text()))


def test_a_call_that_stands_still_is_stopped_and_one_that_goes_on_is_not(tmp_path):
    with ProcessExecutor(2, CallLimits(stall_s=5)) as executor:
        stalled, steady = executor.submit(hang, tmp_path / "pid"), executor.submit(slow_steps, 80)
        with pytest.raises(VideoStalledError, match="no further frame for 5 s"):
            stalled.result()
        assert steady.result() == 80
    assert not psutil.pid_exists(int((tmp_path / "pid").read_text()))


def test_frames_are_told_while_the_call_runs():
    with ProcessExecutor(1) as executor:
        future = executor.submit(slow_steps, 30)
        seen = set()
        while not future.done():
            seen.add(executor.frames(future))
            time.sleep(0.01)
    assert len(seen) > 2
    assert seen <= {(0, 0), *((done, 30) for done in range(31))}


def test_calls_that_are_cancelled_leave_no_process(tmp_path):
    executor = ProcessExecutor(2)
    paths = [tmp_path / str(number) for number in range(3)]
    futures = [executor.submit(hang, path) for path in paths]
    while not all(path.exists() and path.read_text() for path in paths[:2]):
        time.sleep(0.01)
    executor.shutdown(cancel_futures=True)
    for future in futures:
        with pytest.raises(CancelledError):
            future.result()
    for path in paths[:2]:
        assert not psutil.pid_exists(int(path.read_text()))
    assert not paths[2].exists()


def is_alive(process):
    """Whether a process still does something; a zombie does not."""
    try:
        return process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def wait_for_pid(path, parent):
    while not (path.exists() and path.read_text()):
        assert parent.poll() is None
        time.sleep(0.01)


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_nothing_is_left_of_a_parent_that_is_killed(tmp_path, short_folder):
    parent = report_pid(tmp_path / "pid", short_folder)
    wait_for_pid(tmp_path / "pid", parent)
    family = psutil.Process(parent.pid).children(recursive=True)
    assert int((tmp_path / "pid").read_text()) in [each.pid for each in family]
    parent.kill()
    parent.wait()
    while any(map(is_alive, family)):
        time.sleep(0.01)
    assert list(short_folder.iterdir()) == []


@pytest.mark.skipif(sys.platform != "linux", reason="only there processes are forked by another")
def test_the_next_run_removes_what_one_that_was_killed_whole_has_left(
    tmp_path, short_folder, monkeypatch
):
    places = {"PYTHONPATH": str(Path(calls.__file__).parents[1]), "TMPDIR": str(short_folder)}
    code = (
        "import os, signal\nfrom situp_annotate.executors import ProcessExecutor\n"
        "from multiprocessing.forkserver import _forkserver\nProcessExecutor(1)\n"
        "os.kill(_forkserver._forkserver_pid, signal.SIGKILL)\nos.kill(os.getpid(), signal.SIGKILL)"
    )
    subprocess.run([sys.executable, "-c", code], env=os.environ | places, check=False)
    assert len([*short_folder.iterdir()]) == 1
    monkeypatch.setattr(tempfile, "tempdir", str(short_folder))
    annotate_batch([], tmp_path / "out")
    assert list(short_folder.iterdir()) == []


@pytest.mark.skipif(os.name != "posix", reason="sockets that have a path")
def test_the_temporary_folder_may_have_a_long_name(tmp_path):
    folder = tmp_path / ("long" * 25)
    folder.mkdir()
    parent = report_pid(tmp_path / "pid", folder)
    wait_for_pid(tmp_path / "pid", parent)
    parent.kill()
    parent.wait()
    assert list(folder.iterdir()) == []
