"""Calls for worker processes, which find them here whatever started the tests."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from situp_annotate.executors import report_frames

mark = "not set"


def read_mark():
    return mark


def square(number):
    return number * number


def fail():
    raise ValueError("no")


def pid_of():
    return os.getpid()


def die(_number):
    os.kill(os.getpid(), signal.SIGKILL)


def end_politely(_number):
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(60)


def crash(_number):
    os.kill(os.getpid(), signal.SIGSEGV)


def crash_unless_first(path):
    """Die in a process that has made a call before, which then stands in this file."""
    pid = os.getpid()
    if path.exists() and path.read_text() == str(pid):
        crash(pid)
    path.write_text(str(pid))
    return pid


def hang(path):
    path.write_text(str(os.getpid()))
    while True:
        time.sleep(60)


def slow_steps(count):
    for done in range(1, count + 1):
        time.sleep(0.1)
        report_frames(done, count)
    return count


def report_pid(path, temporary):
    """Start a process whose worker process writes its number to a file and hangs."""
    code = (
        "import sys; from pathlib import Path; from support.calls import hang\n"
        "from situp_annotate.executors import ProcessExecutor\n"
        "ProcessExecutor(1).submit(hang, Path(sys.argv[1])).result()"
    )
    places = {"PYTHONPATH": str(Path(__file__).parents[1]), "TMPDIR": str(temporary)}
    environment = os.environ | places
    return subprocess.Popen([sys.executable, "-c", code, str(path)], env=environment)
