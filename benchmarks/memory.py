"""Peak memory of a worker on a 1080p video, and whether it grows with the video's length.

    python benchmarks/memory.py --sequences FOLDER --json FILE

FOLDER holds sequences in OTB layout. The longest one's pictures, enlarged to 1920×1080, become two
videos, one four times as long as the other; each goes through the whole pipeline, with all
outputs, in a fresh worker process, which reports its own peak (VmHWM, Linux).
"""

import itertools
import json
import re
import tempfile
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import click
import cv2
import numpy as np

from situp_annotate import annotate_video
from situp_annotate.evaluation import OtbSequence, find_sequences
from situp_annotate.executors import ProcessExecutor
from situp_annotate.types import BoundingBox, Keyframe, Track, VideoJob
from situp_annotate.video import open_video
from situp_annotate.video.writer import H264Writer

WIDTH, HEIGHT = 1920, 1080
LENGTHS = (100, 400)


@dataclass(frozen=True)
class Peak:
    """Frames of a video and the worker's peak in MB."""

    frames: int
    megabytes: float


def enlarge(sequence: OtbSequence, frames: int, path: Path) -> VideoJob:
    """Write a 1080p video of so many frames, starting over at the sequence's end."""
    step_ns = 40_000_000
    with open_video(sequence.folder) as source:
        across, down = WIDTH / source.info.width, HEIGHT / source.info.height
    with H264Writer(path, width=WIDTH, height=HEIGHT, frame_rate=Fraction(25)) as writer:
        written = 0
        while written < frames:
            with open_video(sequence.folder) as source:
                for frame in itertools.islice(source, frames - written):
                    large = np.asarray(cv2.resize(frame.image, (WIDTH, HEIGHT)), np.uint8)
                    writer.write(large, written * step_ns)
                    written += 1
    box = sequence.targets[0].first_box
    enlarged = BoundingBox(box.x * across, box.y * down, box.width * across, box.height * down)
    return VideoJob(path.stem, path, (Track(1, sequence.name, (Keyframe(0, enlarged),)),))


def peak_of(job: VideoJob, output: Path) -> Peak:
    """Annotate in this process and read its peak; runs in a fresh worker."""
    cv2.setNumThreads(1)
    report = annotate_video(job, output)
    (kilobytes,) = re.findall(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
    return Peak(report.frames, int(kilobytes) / 1000)


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path), required=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
def main(sequences: Path, json_path: Path) -> None:
    """Measure both videos, print and write the figures."""
    longest = max(find_sequences(sequences), key=lambda each: len(each.targets[0].truth))
    peaks = []
    with tempfile.TemporaryDirectory() as name, ProcessExecutor(1) as pool:
        folder = Path(name)
        for frames in LENGTHS:
            job = enlarge(longest, frames, folder / f"{frames}.mp4")
            peaks.append(pool.submit(peak_of, job, folder / "out").result())
            print(f"{longest.name}, {peaks[-1].frames} frames: {peaks[-1].megabytes:.0f} MB")
    bars = {
        "peak_mb": peaks[-1].megabytes,
        "growth_mb_with_four_times_the_length": peaks[-1].megabytes - peaks[0].megabytes,
    }
    print(json.dumps(bars, indent=2))
    figures = {"bars": bars, "videos": [vars(peak) for peak in peaks]}
    json_path.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
