"""How much faster two worker processes are than one.

    python benchmarks/workers.py --json FILE [--sequences FOLDER] [--videos 8] [--repeats 3]

Equal clips, drawn here or the videos of FOLDER, are annotated with all outputs by two worker
processes and by one, in turns.
"""

import json
import statistics
import tempfile
import time
from pathlib import Path

import click
from generated import draw_clip, jobs_of

from situp_annotate.batch import annotate_batch
from situp_annotate.types import VideoJob

SIZE_HW = (480, 640)
FRAMES = 100


def seconds_for(jobs: list[VideoJob], folder: Path, workers: int) -> float:
    """Wall time of a batch."""
    with tempfile.TemporaryDirectory(dir=folder) as output:
        started = time.perf_counter()
        report = annotate_batch(jobs, output, workers=workers)
        seconds = time.perf_counter() - started
    if report.failures:
        raise click.ClickException(report.failures[0].message)
    return seconds


def in_turns(jobs: list[VideoJob], folder: Path, repeats: int) -> dict[int, float]:
    """Median wall time by the number of workers."""
    taken: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(repeats):
        for workers, seconds in taken.items():
            seconds.append(seconds_for(jobs, folder, workers))
    return {workers: statistics.median(seconds) for workers, seconds in taken.items()}


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
        seconds = in_turns(jobs, folder, repeats)
    figures = {"bars": {"two_over_one": seconds[1] / seconds[2]}, "seconds_by_workers": seconds}
    print(json.dumps(figures, indent=2))
    json_path.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
