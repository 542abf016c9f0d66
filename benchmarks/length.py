"""What two keyframes at the ends of a long 1080p video cost: memory, and time beside one pass.

    python benchmarks/length.py --sequences FOLDER --json FILE [--minutes 10]

FOLDER holds sequences in OTB layout. The longest one's pictures, enlarged to 1920×1080, are played
to and fro for so many minutes. Its first target is tracked forward and backward, and forward alone,
each in a fresh worker process that reports its own peak (VmHWM, Linux).
"""

import itertools
import json
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
from situp_annotate.evaluation import OtbSequence, find_sequences
from situp_annotate.executors import ProcessExecutor
from situp_annotate.types import BoundingBox, Keyframe, Track, VideoJob
from situp_annotate.video import open_video
from situp_annotate.video.writer import H264Writer

WIDTH, HEIGHT = 1920, 1080
FRAMES_PER_S = 25
STEP_NS = 1_000_000_000 // FRAMES_PER_S


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
    """

    frames: int
    seconds: float
    megabytes: float


def to_and_fro(count: int) -> Iterator[int]:
    """Indices of so many frames from the first to the last, back, and so on without end."""
    return itertools.cycle([*range(count), *range(count - 2, 0, -1)])


def generate(sequence: OtbSequence, path: Path, frames: int) -> VideoJob:
    """Write the video, and a job with keyframes at both ends."""
    with open_video(sequence.folder) as source:
        pictures = [frame.image for frame in source]
    height, width = pictures[0].shape[:2]
    truth = sequence.targets[0].truth[: len(pictures)] - (1, 1, 0, 0)
    boxes = truth * (WIDTH / width, HEIGHT / height, WIDTH / width, HEIGHT / height)
    keyframes = []
    with H264Writer(path, width=WIDTH, height=HEIGHT, frame_rate=Fraction(FRAMES_PER_S)) as writer:
        for index, place in zip(range(frames), to_and_fro(len(boxes)), strict=False):
            large = np.asarray(cv2.resize(pictures[place], (WIDTH, HEIGHT)), np.uint8)
            writer.write(large, index * STEP_NS)
            if index in (0, frames - 1):
                keyframes.append(Keyframe(index, BoundingBox(*map(float, boxes[place]))))
    track = Track(1, sequence.name, tuple(keyframes))
    return VideoJob(path.stem, path, (track,))


def cost_of(job: VideoJob, output: Path, direction: str) -> Cost:
    """Annotate in this process and read its peak; runs in a fresh worker."""
    cv2.setNumThreads(1)
    compile_kernels()
    recipe = load_recipe("csv_only", [f"propagation.direction={direction}"])
    report = annotate_video(job, output, recipe, cache=False)
    (kilobytes,) = re.findall(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
    return Cost(report.frames, report.seconds["total"], int(kilobytes) / 1000)


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path), required=True)
@click.option("--minutes", type=click.FloatRange(min=0.1), default=0.3, show_default=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
def main(sequences: Path, minutes: float, json_path: Path) -> None:
    """Measure both, print and write the figures."""
    frames = round(60 * minutes * FRAMES_PER_S)
    longest = max(find_sequences(sequences), key=lambda each: len(each.targets[0].truth))
    costs = {}
    with tempfile.TemporaryDirectory() as name, ProcessExecutor(1) as pool:
        folder = Path(name)
        job = generate(longest, folder / "long.mp4", frames)
        for direction in ("forward", "both"):
            cost = pool.submit(cost_of, job, folder / direction, direction).result()
            costs[direction] = cost
            print(
                f"{direction}: {cost.frames} frames in {cost.seconds:.1f} s, "
                f"{cost.megabytes:.0f} MB"
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
