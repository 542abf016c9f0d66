"""How much faster two worker processes are than one.

    python benchmarks/workers.py --json FILE [--sequences FOLDER] [--videos 8] [--repeats 3]

Equal clips, drawn here or the videos of FOLDER, are annotated with all outputs by two worker
processes and by one, in turns. The one has one core for itself; left to itself it would follow
tracks and encode in threads on the other, which is the second ratio.
"""

import json
import os
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import click
import psutil
from generated import draw_clip, jobs_of

from situp_annotate.batch import annotate_batch
from situp_annotate.types import VideoJob

SIZE_HW = (480, 640)
FRAMES = 100

_CORES = sorted(os.sched_getaffinity(0))


def use_cores(count: int) -> None:
    """Let this process and those that it has started use so many of the first cores."""
    for process in (psutil.Process(), *psutil.Process().children(recursive=True)):
        process.cpu_affinity(_CORES[:count])


def seconds_for(jobs: list[VideoJob], folder: Path, workers: int) -> float:
    """Wall time of a batch."""
    with tempfile.TemporaryDirectory(dir=folder) as output:
        started = time.perf_counter()
        report = annotate_batch(jobs, output, workers=workers)
        seconds = time.perf_counter() - started
    if report.failures:
        raise click.ClickException(report.failures[0].message)
    return seconds


def alone(jobs: list[VideoJob], folder: Path) -> float:
    """Wall time of one worker that has one core."""
    use_cores(1)
    try:
        return seconds_for(jobs, folder, 1)
    finally:
        use_cores(2)


def in_turns(jobs: list[VideoJob], folder: Path, repeats: int) -> dict[str, float]:
    """Median wall times of two workers, and of one on one core and on two."""
    ways: dict[str, Callable[[], float]] = {
        "two_workers": lambda: seconds_for(jobs, folder, 2),
        "one_worker": lambda: alone(jobs, folder),
        "one_worker_with_threads": lambda: seconds_for(jobs, folder, 1),
    }
    taken: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(repeats):
        for name, way in ways.items():
            taken[name].append(way())
    return {name: statistics.median(each) for name, each in taken.items()}


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path), help="videos to use")
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
@click.option("--videos", default=8, show_default=True)
@click.option("--repeats", default=3, show_default=True, help="runs of each kind")
def main(sequences: Path | None, json_path: Path, videos: int, repeats: int) -> None:
    """Measure, print and write the figures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        jobs = jobs_of(sequences, videos) if sequences else []
        for number in range(videos - len(jobs)):
            jobs.append(draw_clip(folder / f"{number}.mp4", 0, FRAMES, SIZE_HW, boxes=1))
        seconds_for(jobs[:1], folder, 1)  # starts the process that workers are forked from
        use_cores(2)
        seconds = in_turns(jobs, folder, repeats)
    bars = {
        "two_over_one": seconds["one_worker"] / seconds["two_workers"],
        "two_over_one_with_threads": seconds["one_worker_with_threads"] / seconds["two_workers"],
    }
    print(json.dumps({"seconds": seconds, "bars": bars}, indent=2))
    json_path.write_text(json.dumps({"bars": bars, "seconds": seconds}, indent=2) + "\n")


if __name__ == "__main__":
    main()
