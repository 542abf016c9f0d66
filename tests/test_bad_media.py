"""Every file of the corpus of bad media ends in the outcome that is documented, and soon."""

import json
import subprocess
import sys
from pathlib import Path
from select import select

import pytest
from support.corpus import cases

from situp_annotate.compiling import compile_kernels

CASES = {case.name: case for case in cases()}
PATIENCE_S = 60
MOST_KB = 600_000


class Trials:
    """A process that annotates one video after the other; another one takes over when it ends."""

    def __init__(self):
        self._process = None

    def attempt(self, video, output, **options):
        """Outcome of a video; ``crashed`` or ``hangs`` if the process came to no end by itself."""
        process = self._process = self._process or self._start()
        task = {"video": str(video), "output": str(output), **options}
        process.stdin.write(json.dumps(task).encode() + b"\n")
        process.stdin.flush()
        if not select([process.stdout], [], [], PATIENCE_S)[0]:
            self.stop()
            return {"kind": "hangs"}
        answer = process.stdout.readline()
        if answer:
            return json.loads(answer)
        exit_code = process.wait()
        self.stop()
        return {"kind": "crashed", "exit_code": exit_code}

    def stop(self):
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def _start(self):
        return subprocess.Popen(
            [sys.executable, "-m", "support.trial"],
            cwd=Path(__file__).parent,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )


@pytest.fixture(scope="module")
def trials():
    compile_kernels()  # so that no video waits for that
    trials = Trials()
    yield trials
    trials.stop()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where the files of the corpus are written; some are made of the same ones."""
    return tmp_path_factory.mktemp("corpus")


@pytest.mark.parametrize("name", CASES)
def test_bad_media(name, trials, folder, tmp_path):
    case = CASES[name]
    case.write(folder / name)
    output = tmp_path / "out"
    outcome = trials.attempt(folder / name, output, overlay=case.overlay, keep=case.keep)
    assert case.why_wrong(outcome) is None, outcome
    assert outcome["peak_kb"] < MOST_KB
    assert ("message" in outcome) == (outcome["kind"] != "ok")
    left = {path.name for path in output.iterdir()}
    assert left == ({"trial"} if outcome["kind"] == "ok" else set())


def test_a_crash_and_a_hang_are_told_of_the_video_that_caused_them(trials, tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules[__name__], "PATIENCE_S", 1)
    monkeypatch.setattr(trials, "_start", lambda: start_stub("os._exit(3)"))
    trials.stop()
    assert trials.attempt(tmp_path, tmp_path) == {"kind": "crashed", "exit_code": 3}
    monkeypatch.setattr(trials, "_start", lambda: start_stub("time.sleep(99)"))
    assert trials.attempt(tmp_path, tmp_path) == {"kind": "hangs"}


def start_stub(statement):
    code = f"import os, time; input(); {statement}"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    return subprocess.Popen([sys.executable, "-c", code], **pipes)
