"""What bad media cost: time and memory of each file of the tests' corpus, and what becomes of it.

    python benchmarks/bad_media.py --json FILE [--sequences FOLDER]

The corpus is generated. Each of its files, and each file or folder in FOLDER, is annotated in a
fresh process with one short track in both directions; the time is that of the whole process, its
start included, and the memory its peak. Linux.
"""

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from situp_annotate.compiling import compile_kernels

TESTS = Path(__file__).parents[1] / "tests"
PATIENCE_S = 60
"""After so long a process is killed."""


@dataclass(frozen=True)
class Cost:
    """Of one file.

    Attributes
    ----------
    outcome : str
        ``"ok"``, the kind of the error, ``"internal"`` for one that nobody foresaw, ``"crashed"``
        or ``"hangs"``.
    expected : list of str
        The outcomes that are right; of files that are not of the corpus every foreseen one.
    seconds, megabytes : float
        Wall time and peak of the process.
    """

    outcome: str
    expected: list[str]
    seconds: float
    megabytes: float

    @property
    def right(self) -> bool:
        """Whether the outcome is as expected."""
        if not self.expected:
            return self.outcome not in ("internal", "crashed", "hangs")
        return self.outcome in self.expected


def write_corpus(folder: Path) -> dict[str, dict[str, Any]]:
    """Write all files, and tell of each what has to become of it."""
    command = [sys.executable, "-m", "support.corpus", str(folder)]
    written = subprocess.run(command, cwd=TESTS, check=True, capture_output=True)
    corpus: dict[str, dict[str, Any]] = json.loads(written.stdout)
    return corpus


def cost_of(video: Path, output: Path, expected: list[str], **options: bool) -> Cost:
    """Annotate a video in a process of its own."""
    task = json.dumps({"video": str(video), "output": str(output), **options})
    started = time.perf_counter()
    with tempfile.TemporaryFile() as answer, subprocess.Popen(
        [sys.executable, "-m", "support.trial"],
        cwd=TESTS,
        stdin=subprocess.PIPE,
        stdout=answer,
        stderr=subprocess.DEVNULL,
    ) as process:  # fmt: skip
        assert process.stdin is not None
        process.stdin.write(task.encode())
        process.stdin.close()
        killer = threading.Timer(PATIENCE_S, process.kill)
        killer.start()
        _, status, usage = os.wait4(process.pid, 0)
        killer.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        seconds = time.perf_counter() - started
        answer.seek(0)
        outcome = answer.read()
    if outcome:
        kind = json.loads(outcome)["kind"]
    else:
        kind = "hangs" if seconds > PATIENCE_S else "crashed"
    return Cost(kind, expected, seconds, usage.ru_maxrss / 1000)


def show(name: str) -> str:
    """Name of a file, in characters that any terminal can show."""
    return ascii(name)[1:-1]


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path))
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
def main(sequences: Path | None, json_path: Path) -> None:
    """Measure, print a table and write the figures."""
    compile_kernels()
    costs: dict[str, Cost] = {}
    with tempfile.TemporaryDirectory() as name:
        corpus_folder, output = Path(name) / "corpus", Path(name) / "out"
        corpus_folder.mkdir()
        print(f"{'file':32} {'outcome':12} {'expected':24} {'s':>6} {'MB':>6}")
        for file, case in write_corpus(corpus_folder).items():
            costs[file] = cost_of(corpus_folder / file, output / str(len(costs)), **case)
            report(file, costs[file])
        for video in sorted(sequences.iterdir()) if sequences else ():
            costs[str(video)] = cost_of(video.absolute(), output / str(len(costs)), [])
            report(str(video), costs[str(video)])
    bars = {
        "wrong_outcomes": sum(not cost.right for cost in costs.values()),
        "slowest_s": max(cost.seconds for cost in costs.values()),
        "largest_mb": max(cost.megabytes for cost in costs.values()),
    }
    print(json.dumps(bars, indent=2))
    files = {show(file): vars(cost) for file, cost in costs.items()}
    json_path.write_text(json.dumps({"bars": bars, "files": files}, indent=2) + "\n")


def report(name: str, cost: Cost) -> None:
    """Print a line of the table."""
    expected = "/".join(cost.expected) if len(cost.expected) < 3 else "any that is documented"
    mark = "" if cost.right else "  wrong"
    figures = f"{cost.seconds:6.1f} {cost.megabytes:6.0f}{mark}"
    print(f"{show(name):32} {cost.outcome:12} {expected or 'any':24} {figures}", flush=True)


if __name__ == "__main__":
    main()
