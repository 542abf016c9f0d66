"""Kill a run again and again, go on with it, and see whether its outputs come out the same.

    python benchmarks/kills.py --json FILE [--sequences FOLDER] [--kills 100] [--videos 30]

Short clips, drawn here or the videos of FOLDER, are annotated once without disturbance. Then
`situp-annotate run` is started over and over with one output folder, and the parent, a worker or
one of their helpers gets a SIGKILL at a random moment, often soon after the start or shortly before
the end. After each kill what stands in the output folder must be whole, after one of the parent no
process may be left; when all videos are done, every file must be as in the undisturbed run, and the
next folder is begun. Every other folder holds outputs of another recipe, which are to be replaced.
Of ``batch.json`` the times do not count, an MCAP file is compared by what it says, a file of the
cache by its arrays; logs and ``.run`` may differ.
"""

import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
import uuid
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click
import psutil
from generated import draw_clip, jobs_of, write_manifest
from same_outputs import differences, halves, left_behind

from situp_annotate.compiling import compile_kernels

SIZE_HW = (120, 160)
SHORTEST, LONGEST = 10, 30
MARK = "SITUP_ANNOTATE_KILLS"
KINDS, WEIGHTS = ("parent", "worker", "helper"), (9, 9, 2)
SOON_S = 1.0
"""How long to wait for a process of the kind that is to be killed."""
GONE_WITHIN_S = 30.0
SUCCESS, SOME_FAILED = 0, 1


@dataclass
class Findings:
    """What was done, and what was wrong with it.

    Attributes
    ----------
    kills : Counter
        How often each kind of process was killed.
    rounds : int
        How often all videos were done in the end.
    longest_s : float
        Until the last process was gone after the parent was killed.
    wrong : list of str
        A line for each thing that is not as it should be.
    """

    kills: Counter[str] = field(default_factory=Counter)
    rounds: int = 0
    longest_s: float = 0.0
    wrong: list[str] = field(default_factory=list)

    def add(self, lines: list[str], where: str) -> None:
        """Take down what is wrong, and show it."""
        for line in lines:
            self.wrong.append(f"{where}: {line}")
            print(self.wrong[-1], flush=True)


class Run:
    """A process of `situp-annotate run`, and those that it starts.

    Parameters
    ----------
    manifest, output : Path
        As on the command line.
    temporary : Path
        Where its temporary files go.
    recipe : str
        As on the command line.
    """

    def __init__(self, manifest: Path, output: Path, temporary: Path, recipe: str) -> None:
        self._mark = uuid.uuid4().hex
        self._log = output.with_suffix(".log")
        command = [sys.executable, "-m", "situp_annotate", "run", str(manifest), "-o", str(output)]
        environment = {**os.environ, MARK: self._mark, "TMPDIR": str(temporary)}
        with self._log.open("w") as log:
            self._parent = subprocess.Popen(
                [*command, "--recipe", recipe, "--workers", "2"],
                env=environment,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )

    @property
    def pid(self) -> int:
        """Of the parent."""
        return self._parent.pid

    @property
    def said(self) -> str:
        """What it has printed."""
        return self._log.read_text()

    def wait(self, seconds: float | None = None) -> int | None:
        """Exit code of the parent; None if it goes on for longer."""
        try:
            return self._parent.wait(seconds)
        except subprocess.TimeoutExpired:
            return None

    def processes(self) -> list[psutil.Process]:
        """All processes of the run."""
        found = []
        for process in psutil.process_iter():
            with suppress(psutil.Error):
                if process.environ().get(MARK) == self._mark:
                    found.append(process)
        return found

    def victims(self) -> dict[str, list[psutil.Process]]:
        """Processes by what they are for; helpers are those that fork workers and clean up."""
        victims: dict[str, list[psutil.Process]] = {kind: [] for kind in KINDS}
        for process in self.processes():
            with suppress(psutil.Error):
                own = process.pid == self.pid
                forked = process.ppid() not in (self.pid, os.getpid())
                victims["parent" if own else "worker" if forked else "helper"].append(process)
        return victims

    def seconds_to_vanish(self) -> float | None:
        """How long it takes until no process is left; None, and an end to it, if it does not."""
        started = time.monotonic()
        while left := self.processes():
            if time.monotonic() - started > GONE_WITHIN_S:
                for process in left:
                    process.kill()
                return None
            time.sleep(0.01)
        return time.monotonic() - started


def odd_failures(output: Path) -> list[str]:
    """Videos that failed for another cause than that their process was killed."""
    videos = json.loads((output / "batch.json").read_bytes())["videos"]
    return [
        f"{video['id']}: {video['message']}"
        for video in videos
        if video["status"] == "failed" and video["kind"] != "killed"
    ]


class Killer:
    """Starts runs and kills their processes.

    Parameters
    ----------
    manifest : Path
        What to annotate.
    folder : Path
        Where everything goes.
    seed : int
        Of what is left to chance.
    """

    def __init__(self, manifest: Path, folder: Path, seed: int) -> None:
        self.findings = Findings()
        self._manifest = manifest
        self._undisturbed = folder / "undisturbed"
        self._earlier = folder / "earlier"
        self._folder = folder
        self._temporary = folder / "temporary"
        self._temporary.mkdir()
        self._random = random.Random(seed)
        self._run_s = self._all_s = 0.0

    def run_undisturbed(self) -> None:
        """Make what everything is compared with; find out how long a run takes."""
        for attempt in ("whole", "nothing to do"):
            started = time.monotonic()
            run = self._start(self._undisturbed)
            if run.wait() != SUCCESS:
                raise click.ClickException(f"the undisturbed run failed: {run.said}")
            self._run_s = time.monotonic() - started
            if attempt == "whole":
                self._all_s = self._run_s
        self._look_for_strays(self._undisturbed)
        if self._start(self._earlier, "csv_only").wait() != SUCCESS:
            raise click.ClickException("the earlier run failed")

    def kill(self, count: int) -> None:
        """Kill so often, in one output folder after the other, and finish the last."""
        while self.findings.kills.total() < count:
            output = self._folder / f"round-{self.findings.rounds + 1}"
            if self.findings.rounds % 2:
                shutil.copytree(self._earlier, output)
            before, code = -1, None
            while code != SUCCESS and self.findings.kills.total() > before:
                before = self.findings.kills.total()
                code = self._disturb(output, count)
            self.findings.rounds += 1
            self.findings.add(differences(self._undisturbed, output), output.name)
            self._look_for_strays(output)

    def _look_for_strays(self, output: Path) -> None:
        self.findings.add(left_behind(output, self._temporary), output.name)
        shutil.rmtree(self._temporary)
        self._temporary.mkdir()

    def _start(self, output: Path, recipe: str = "situp") -> Run:
        return Run(self._manifest, output, self._temporary, recipe)

    def _moment(self, output: Path) -> float:
        """Seconds to wait: early and late in what a run needs for what is left."""
        done, videos = (
            sum(1 for _ in folder.glob("*/overlay.mp4")) for folder in (output, self._undisturbed)
        )
        expected_s = self._run_s + (self._all_s - self._run_s) * (1 - done / videos)
        return expected_s * self._random.betavariate(0.5, 0.5)

    def _disturb(self, output: Path, count: int) -> int | None:
        """Run until the end, or until the parent is killed; return the exit code."""
        run = self._start(output)
        while self.findings.kills.total() < count:
            code = run.wait(self._moment(output))
            if code is not None:
                return self._ended(run, code, output)
            if self._kill_one(run, output):
                return None
        return self._ended(run, run.wait(), output)

    def _kill_one(self, run: Run, output: Path) -> bool:
        """Kill a process of a run; whether it was the parent."""
        kind = self._random.choices(KINDS, WEIGHTS)[0]
        deadline = time.monotonic() + SOON_S
        while not (victims := run.victims()[kind]):
            if time.monotonic() > deadline:
                return False
        self._random.choice(victims).kill()
        self.findings.kills[kind] += 1
        where = f"{output.name}, kill {self.findings.kills.total()} ({kind})"
        print(where, flush=True)
        if kind == "parent":
            run.wait()
            self._expect_end(run, where)
        self.findings.add(halves([self._undisturbed, self._earlier], output), where)
        return kind == "parent"

    def _ended(self, run: Run, code: int | None, output: Path) -> int | None:
        """See to it that a run that came to its end by itself did so properly."""
        where = f"{output.name}, after {self.findings.kills.total()} kills"
        if code not in (SUCCESS, SOME_FAILED):
            self.findings.add([f"exit code {code}: {run.said}"], where)
        else:
            self.findings.add(odd_failures(output), where)
        self._expect_end(run, where)
        return code

    def _expect_end(self, run: Run, where: str) -> None:
        seconds = run.seconds_to_vanish()
        if seconds is None:
            self.findings.add([f"processes were left for {GONE_WITHIN_S:g} s"], where)
        else:
            self.findings.longest_s = max(self.findings.longest_s, seconds)
        shared = Path("/dev/shm").glob(f"pym-{run.pid}-*")
        self.findings.add([f"{path} was left behind" for path in shared], where)


def clips(folder: Path, count: int, seed: int) -> Iterator[Any]:
    """Draw clips with one box, or two or three, which are followed both ways."""
    lengths = random.Random(seed)
    for number in range(count):
        frames = lengths.randint(SHORTEST, LONGEST)
        path = folder / f"clip-{number + 1:02}.mp4"
        yield draw_clip(path, seed + number, frames, SIZE_HW, boxes=1 + number % 3)


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path), help="videos to use")
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
@click.option("--kills", default=100, show_default=True, help="in all")
@click.option("--videos", default=30, show_default=True)
@click.option("--seed", type=int, help="of clips and moments; another each time by default")
def main(
    sequences: Path | None, json_path: Path, kills: int, videos: int, seed: int | None
) -> None:
    """Kill, compare, print and write what was found."""
    compile_kernels()
    seed = random.randrange(10**6) if seed is None else seed
    print(f"seed {seed}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        jobs = jobs_of(sequences, videos) if sequences else [*clips(folder, videos, seed)]
        killer = Killer(write_manifest(jobs, folder / "manifest.json"), folder, seed)
        killer.run_undisturbed()
        killer.kill(kills)
    findings = killer.findings
    bars = {"kills": findings.kills.total(), "wrong": len(findings.wrong)}
    print(json.dumps(bars, indent=2))
    figures = {
        "bars": bars,
        "seed": seed,
        "videos": videos,
        "by_process": findings.kills,
        "rounds": findings.rounds,
        "longest_until_all_gone_s": findings.longest_s,
        "wrong": findings.wrong,
    }
    json_path.write_text(json.dumps(figures, indent=2) + "\n")
    sys.exit(1 if findings.wrong else 0)


if __name__ == "__main__":
    main()
