"""Whatever of a run is killed, and when: going on with it leaves no trace of that."""

import json
import subprocess
import sys
from pathlib import Path

KILLS = Path(__file__).parents[1] / "benchmarks" / "kills.py"


def test_a_run_that_was_killed_again_and_again_ends_as_if_nothing_had_been(tmp_path):
    figures = tmp_path / "kills.json"
    options = ["--videos", "6", "--kills", "8", "--seed", "6", "--json", str(figures)]
    run = subprocess.run(
        [sys.executable, str(KILLS), *options], capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stdout + run.stderr
    found = json.loads(figures.read_text())
    assert found["wrong"] == []
    assert found["by_process"].keys() >= {"parent", "worker"}
