"""Ctrl-C once and twice, and being asked to end."""

import os
import signal
import subprocess
import sys
from functools import partial

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")

_CODE = """
import time
from situp_annotate.cli._signals import stopped_by_signals
try:
    with stopped_by_signals():
        try:
            print("ready", flush=True)
            time.sleep(60)
        except KeyboardInterrupt:
            print("stopping", flush=True)
            time.sleep(60)
except KeyboardInterrupt:
    pass
print("not reached")
"""


def start(handling=signal.SIG_DFL):
    return subprocess.Popen(
        [sys.executable, "-c", _CODE],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=partial(signal.signal, signal.SIGINT, handling),
    )


@pytest.mark.parametrize("first", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_the_first_signal_stops_and_the_second_ends_at_once(first):
    with start() as process:
        assert process.stdout.readline() == "ready\n"
        process.send_signal(first)
        assert process.stdout.readline() == "stopping\n"
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, "")
    assert err == "\nStopping the workers; once more to stop at once.\n"


def test_what_is_ignored_stays_ignored():
    with start(signal.SIG_IGN) as process:
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGTERM)
        assert process.stdout.readline() == "stopping\n"
        process.kill()
