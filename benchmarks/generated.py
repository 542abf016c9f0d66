"""Clips to run batches over: drawn here, or those of a folder."""

import itertools
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np

from situp_annotate.formats.manifest import dump_manifest
from situp_annotate.types import BoundingBox, Image, Keyframe, Track, VideoJob
from situp_annotate.video import find_videos, open_video
from situp_annotate.video.writer import H264Writer

FRAMES_PER_S = 25
STEP_NS = 1_000_000_000 // FRAMES_PER_S


def noise(random: np.random.Generator, size_hw: tuple[int, int]) -> Image:
    """A picture of soft blotches, which a tracker can follow and an encoder can shrink."""
    height, width = size_hw
    small = random.integers(0, 256, (height // 8 + 1, width // 8 + 1, 3), dtype=np.uint8)
    return np.asarray(cv2.resize(small, (width, height), interpolation=cv2.INTER_CUBIC), np.uint8)


def target_at(frame: int, frames: int, size_hw: tuple[int, int]) -> BoundingBox:
    """Where the target of a drawn clip is: it crosses half of the picture."""
    height, width = size_hw
    side = height // 4
    return BoundingBox(width // 8 + frame * width // 2 // frames, height // 4, side, side)


def pictures(seed: int, frames: int, size_hw: tuple[int, int]) -> Iterator[Image]:
    """Pictures of a target that moves in front of others."""
    random = np.random.default_rng(seed)
    scene, target = noise(random, size_hw), noise(random, (size_hw[0] // 4, size_hw[0] // 4))
    for frame in range(frames):
        box = target_at(frame, frames, size_hw)
        picture = scene.copy()
        rows = slice(int(box.y), int(box.bottom))
        picture[rows, int(box.x) : int(box.right)] = target
        yield picture


def draw_clip(path: Path, seed: int, frames: int, size_hw: tuple[int, int], boxes: int) -> VideoJob:
    """Write a clip, and have its target boxed in so many frames from the first to the last."""
    height, width = size_hw
    with H264Writer(path, width=width, height=height, frame_rate=Fraction(FRAMES_PER_S)) as writer:
        for index, picture in enumerate(pictures(seed, frames, size_hw)):
            writer.write(picture, index * STEP_NS)
    drawn = {number * (frames - 1) // max(boxes - 1, 1) for number in range(boxes)}
    keyframes = tuple(Keyframe(at, target_at(at, frames, size_hw)) for at in sorted(drawn))
    return VideoJob(path.stem, path, (Track(1, "target", keyframes),))


def job_of(path: Path) -> VideoJob:
    """Have a box in the middle of a video followed from its first frame."""
    with open_video(path) as source:
        width, height = source.info.width, source.info.height
    box = BoundingBox(width / 3, height / 3, width / 3, height / 3)
    return VideoJob(path.stem, path.resolve(), (Track(1, "middle", (Keyframe(0, box),)),))


def jobs_of(folder: Path, count: int) -> list[VideoJob]:
    """So many jobs over the videos of a folder, again and again if there are fewer."""
    found = [job_of(path) for path in find_videos(folder)]
    return [
        VideoJob(f"{number}-{job.id}", job.path, job.tracks)
        for number, job in zip(range(count), itertools.cycle(found), strict=False)
    ]


def write_manifest(jobs: list[VideoJob], path: Path) -> Path:
    """Write a manifest of jobs whose videos may be anywhere."""
    path.write_text(dump_manifest(jobs, path.parent), encoding="utf-8")
    return path
