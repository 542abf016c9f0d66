"""What two keyframes at the ends of a long 1080p video cost: memory, and time beside one pass.

    python benchmarks/length.py --json FILE [--minutes 10]

A video is generated in which a textured target goes to and fro on a textured ground. It is tracked
forward and backward, and forward alone, each in a fresh worker process that reports its own peak
(VmHWM, Linux).
"""

import json
import math
import re
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import click
import cv2
import numpy as np

from situp_annotate import annotate_video, load_recipe
from situp_annotate.compiling import compile_kernels
from situp_annotate.executors import ProcessExecutor, result_of
from situp_annotate.formats.mot import read_mot
from situp_annotate.types import BoundingBox, Image, Keyframe, Track, VideoJob
from situp_annotate.video.writer import H264Writer

WIDTH, HEIGHT, SIDE = 1920, 1080, 80
FRAMES_PER_S = 25
STEP_NS = 1_000_000_000 // FRAMES_PER_S
SWAY = 400
"""Pixels that the target goes to either side, and frames that it takes for a radian of that."""


@dataclass(frozen=True)
class Cost:
    """Of annotating a video once.

    Attributes
    ----------
    frames : int
        Of the video.
    seconds : float
        Wall time.
    megabytes : float
        Peak of the process.
    furthest : float
        How many pixels a box was off, at most.
    """

    frames: int
    seconds: float
    megabytes: float
    furthest: float


def texture(height: int, width: int, grain: int, seed: int) -> Image:
    """Smooth noise."""
    noise = np.random.default_rng(seed).integers(
        0, 256, (height // grain + 1, width // grain + 1, 3), dtype=np.uint8
    )
    return np.asarray(cv2.resize(noise, (width, height), interpolation=cv2.INTER_CUBIC), np.uint8)


def box_at(index: int) -> BoundingBox:
    """Where the target is, in whole pixels."""
    x = WIDTH / 2 + SWAY * math.sin(index / SWAY)
    return BoundingBox(round(x), HEIGHT / 2, SIDE, SIDE)


def pictures(frames: int) -> Iterator[Image]:
    """The video's pictures."""
    ground = texture(HEIGHT, WIDTH, 60, seed=1) // 2 + 60
    target = texture(SIDE, SIDE, 16, seed=2)
    for index in range(frames):
        box, image = box_at(index), ground.copy()
        x, y = int(box.x), int(box.y)
        image[y : y + SIDE, x : x + SIDE] = target
        yield image


def generate(path: Path, frames: int) -> VideoJob:
    """Write the video, and a job with keyframes at both ends."""
    with H264Writer(path, width=WIDTH, height=HEIGHT, frame_rate=Fraction(FRAMES_PER_S)) as writer:
        for index, image in enumerate(pictures(frames)):
            writer.write(image, index * STEP_NS)
    keyframes = tuple(Keyframe(index, box_at(index)) for index in (0, frames - 1))
    return VideoJob(path.stem, path, (Track(1, "target", keyframes),))


def cost_of(job: VideoJob, output: Path, direction: str) -> Cost:
    """Annotate in this process and read its peak; runs in a fresh worker."""
    recipe = load_recipe("csv_only", [f"propagation.direction={direction}"])
    report = annotate_video(job, output, recipe, cache=False)
    (kilobytes,) = re.findall(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
    rows = read_mot(output / job.id / "mot.csv")
    furthest = max(abs(row.box.x - box_at(row.frame).x) for row in rows)
    return Cost(report.frames, report.seconds["total"], int(kilobytes) / 1000, furthest)


def start_worker() -> None:
    """What the batch does first in every worker."""
    cv2.setNumThreads(1)
    compile_kernels()


@click.command(help=__doc__)
@click.option("--minutes", type=click.FloatRange(min=0.1), default=0.3, show_default=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
def main(minutes: float, json_path: Path) -> None:
    """Measure both, print and write the figures."""
    frames = round(60 * minutes * FRAMES_PER_S)
    costs = {}
    with tempfile.TemporaryDirectory() as name, ProcessExecutor(1, start_worker, ()) as pool:
        folder = Path(name)
        job = generate(folder / "long.mp4", frames)
        for direction in ("forward", "both"):
            cost = result_of(pool.submit(cost_of, job, folder / direction, direction))
            costs[direction] = cost
            print(
                f"{direction}: {cost.frames} frames in {cost.seconds:.1f} s, "
                f"{cost.megabytes:.0f} MB, at most {cost.furthest:.1f} pixels off"
            )
    bars = {
        "long_video_peak_mb": costs["both"].megabytes,
        "both_over_forward": costs["both"].seconds / costs["forward"].seconds,
    }
    print(json.dumps(bars, indent=2))
    figures = {"bars": bars, "runs": {name: vars(cost) for name, cost in costs.items()}}
    json_path.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
