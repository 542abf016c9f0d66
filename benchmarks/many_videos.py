"""What a batch of many small videos costs beyond the work on them, and how a large one starts.

    python benchmarks/many_videos.py --json FILE [--sequences FOLDER] [--videos 1000]
        [--entries 10000]

Tiny videos, drawn here or those of FOLDER, again and again, go through `situp-annotate run` with
two workers, while the memory of its first process is watched. Then they are annotated portion by
portion, in turns by two processes, and one after the other in this process, on one core and with
threads on all: what a video takes on two cores is compared with half of what it takes on one.
Last come manifests of a few and of a great many entries: how long until the first video is begun,
or until it is seen that all are done, and in how much memory.
"""

import json
import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click
import psutil
from generated import draw_clip, jobs_of, write_manifest

from situp_annotate.batch import annotate_batch
from situp_annotate.compiling import load_kernels
from situp_annotate.recipe import Recipe, load_recipe
from situp_annotate.types import VideoJob

SIZE_HW = (48, 64)
SHORTEST, LONGEST = 5, 8
RECIPES = ("situp", "csv_only")
PORTION = 200
FEW = 100
SETTLED = 50
"""Videos after which a process has loaded what it needs."""
SAMPLE_S = 0.1
BYTES_PER_MB = 1_000_000


@dataclass(frozen=True)
class Memory:
    """Of the first process of a run, at some time.

    Attributes
    ----------
    done : int
        Videos that it was through with.
    own_mb, resident_mb : float
        What only this process has, and all that it has.
    """

    done: int
    own_mb: float
    resident_mb: float


@dataclass
class Watched:
    """A run of the command, and what its first process needed.

    Attributes
    ----------
    seconds : float
        Wall time.
    samples : list of Memory
        From its start to its end.
    """

    seconds: float = 0.0
    samples: list[Memory] = field(default_factory=list)

    @property
    def peak_mb(self) -> float:
        """Most that it had."""
        return max(each.resident_mb for each in self.samples)

    @property
    def growth_mb(self) -> float:
        """How much more of its own it had later than after the first videos."""
        settled = [each.own_mb for each in self.samples if each.done >= SETTLED]
        return max(settled) - settled[0]


def command(manifest: Path, output: Path, recipe: str) -> list[str]:
    """The command that users run."""
    words = [sys.executable, "-m", "situp_annotate", "run", manifest, "--output", output]
    return [str(word) for word in (*words, "--recipe", recipe, "--workers", 2, "--allow-outside")]


def videos_done(output: Path) -> int:
    """Videos that a run is through with, as it says itself."""
    with suppress(OSError, ValueError):
        return int(json.loads((output / ".run" / "progress.json").read_bytes())["videos_done"])
    return 0


def watch(words: list[str], output: Path, until: Callable[[], bool] = lambda: False) -> Watched:
    """Run a command to its end, or stop it when it has come far enough."""
    watched, started = Watched(), time.perf_counter()
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, start_new_session=True) as run:
        process = psutil.Process(run.pid)
        while run.poll() is None:
            with suppress(psutil.Error):
                memory = process.memory_full_info()
                own, resident = memory.uss / BYTES_PER_MB, memory.rss / BYTES_PER_MB
                watched.samples.append(Memory(videos_done(output), own, resident))
            if until():
                os.killpg(run.pid, signal.SIGKILL)
            time.sleep(SAMPLE_S)
    watched.seconds = time.perf_counter() - started
    return watched


# ---- memory over a long run, and time per video -----------------------------------------------


def run_all(manifest: Path, folder: Path, recipe: str) -> dict[str, float]:
    """Annotate all with the command: failures, and memory of the first process."""
    output = folder / f"out-{recipe}"
    watched = watch(command(manifest, output, recipe), output)
    said = json.loads((output / "batch.json").read_bytes())
    shutil.rmtree(output)
    return {
        "videos": said["succeeded"],
        "failed": said["failed"] + said["left"],
        "seconds": watched.seconds,
        "growth_mb": watched.growth_mb,
        "peak_mb": watched.peak_mb,
    }


@contextmanager
def cores(count: int) -> Iterator[None]:
    """Let this process use so many cores."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, sorted(before)[:count])
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def seconds_for(jobs: list[VideoJob], folder: Path, recipe: Recipe, **options: Any) -> float:  # noqa: ANN401
    """Wall time per video of a batch."""
    started = time.perf_counter()
    report = annotate_batch(jobs, folder, recipe, **options)
    seconds = time.perf_counter() - started
    if report.failures:
        raise click.ClickException(f"{report.failures[0].message}")
    shutil.rmtree(folder)
    return seconds / len(jobs)


def in_turns(jobs: list[VideoJob], folder: Path, recipe: Recipe) -> dict[str, float]:
    """Seconds per video of two processes, and of this one on one core and on all."""
    output = folder / "turns"
    ways: dict[str, Callable[[list[VideoJob]], float]] = {
        "two_processes": lambda jobs: seconds_for(jobs, output, recipe, workers=2),
        "one_core": lambda jobs: on_one_core(jobs, output, recipe),
        "serial": lambda jobs: seconds_for(jobs, output, recipe, executor="serial"),
    }
    for way in ways.values():
        way(jobs[:PORTION])  # loads what it needs
    taken: dict[str, list[float]] = {name: [] for name in ways}
    for start in range(0, len(jobs), PORTION):
        for name, way in ways.items():
            taken[name].append(way(jobs[start : start + PORTION]))
    return {name: statistics.median(each) for name, each in taken.items()}


def on_one_core(jobs: list[VideoJob], output: Path, recipe: Recipe) -> float:
    """Seconds per video of the serial executor on one core."""
    with cores(1):
        return seconds_for(jobs, output, recipe, executor="serial")


# ---- large manifests --------------------------------------------------------------------------


def repeated(job: VideoJob, count: int) -> list[VideoJob]:
    """So many videos that are all the same file."""
    return [VideoJob(f"{job.id}-{number}", job.path, job.tracks) for number in range(count)]


def complete(job: VideoJob, copies: list[VideoJob], output: Path) -> None:
    """Make an output folder in which all copies of a video are done."""
    annotate_batch([job], output, load_recipe("csv_only"), executor="serial")
    journal = output / ".run" / "journal.jsonl"
    events = map(json.loads, journal.read_text().splitlines())
    (done,) = (event for event in events if event["event"] == "done")
    summary = json.loads((output / job.id / "summary.json").read_bytes())
    with journal.open("a") as file:
        for copy in copies:
            shutil.copytree(output / job.id, output / copy.id)
            changed = json.dumps({**summary, "id": copy.id}, indent=2)
            (output / copy.id / "summary.json").write_text(changed + "\n")
            file.write(json.dumps({**done, "video": copy.id}) + "\n")


def has_begun(output: Path) -> bool:
    """Whether a run has given out the first video."""
    journal = output / ".run" / "journal.jsonl"
    return journal.exists() and '"event": "started"' in journal.read_text()


def start_of(entries: int, job: VideoJob, folder: Path) -> dict[str, float]:
    """Start a run over so many videos, none of which is done, then all of which are."""
    copies = repeated(job, entries)
    manifest = write_manifest(copies, folder / f"{entries}.json")
    fresh, finished = folder / f"fresh-{entries}", folder / f"finished-{entries}"
    begun = watch(command(manifest, fresh, "csv_only"), fresh, lambda: has_begun(fresh))
    complete(job, copies, finished)
    seen = watch(command(manifest, finished, "csv_only"), finished)
    return {
        "seconds_to_first": begun.seconds,
        "peak_mb_to_first": begun.peak_mb,
        "seconds_if_all_done": seen.seconds,
        "peak_mb_if_all_done": seen.peak_mb,
    }


# ---- all together -----------------------------------------------------------------------------


def tiny_clips(folder: Path, count: int) -> list[VideoJob]:
    """Draw clips of some frames."""
    lengths = range(SHORTEST, LONGEST + 1)
    return [
        draw_clip(folder / f"{number}.mp4", number, lengths[number % len(lengths)], SIZE_HW, 1)
        for number in range(count)
    ]


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path), help="videos to use")
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
@click.option("--videos", default=1000, show_default=True)
@click.option("--entries", default=10_000, show_default=True, help="of the large manifest")
def main(sequences: Path | None, json_path: Path, videos: int, entries: int) -> None:
    """Measure, print and write the figures."""
    load_kernels()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        jobs = jobs_of(sequences, videos) if sequences else tiny_clips(folder, videos)
        manifest = write_manifest(jobs, folder / "manifest.json")
        runs = {recipe: run_all(manifest, folder, recipe) for recipe in RECIPES}
        turns = {recipe: in_turns(jobs, folder, load_recipe(recipe)) for recipe in RECIPES}
        starts = {count: start_of(count, jobs[0], folder) for count in (FEW, entries)}
    bars = {
        "failed": max(run["failed"] for run in runs.values()),
        "growth_mb": max(run["growth_mb"] for run in runs.values()),
        "two_cores_over_half_of_one": {
            recipe: 2 * each["two_processes"] / each["one_core"] for recipe, each in turns.items()
        },
        "two_cores_over_half_of_serial": {
            recipe: 2 * each["two_processes"] / each["serial"] for recipe, each in turns.items()
        },
        "seconds_to_first_of_many": starts[entries]["seconds_to_first"],
        "kb_per_entry": 1000
        * (starts[entries]["peak_mb_to_first"] - starts[FEW]["peak_mb_to_first"])
        / (entries - FEW),
    }
    print(json.dumps({"runs": runs, "seconds_per_video": turns, "starts": starts}, indent=2))
    print(json.dumps(bars, indent=2))
    figures = {"bars": bars, "runs": runs, "seconds_per_video": turns, "starts": starts}
    json_path.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
