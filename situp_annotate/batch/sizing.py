"""How much work and memory videos are expected to need, from what can be known at once."""

import os
from collections.abc import Sequence
from pathlib import Path

import psutil

from situp_annotate.recipe import Recipe
from situp_annotate.types import VideoJob

__all__ = ["core_count", "expected_work", "workers_for_memory"]

_BYTES_PER_FRAME = 16_000  # of a usual video file, in case nobody has counted
_BYTES_PER_PICTURE = 100_000
_USUAL_SIZE_HW = (1080, 1920)

# Measured: what a worker holds besides pictures, and how many pictures it holds besides those
# that `propagation.memory_mb` allows for.
_WORKER_MB = 150
_PICTURES_HELD = 12
_BYTES_PER_MB = 2**20
_SHARE_OF_MEMORY = 0.9

_CGROUP_LIMITS = (
    ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
    (
        "/sys/fs/cgroup/memory/memory.limit_in_bytes",
        "/sys/fs/cgroup/memory/memory.usage_in_bytes",
    ),
)


def core_count() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def expected_work(job: VideoJob) -> float:
    """How long a video will take against others, in frames times tracks.

    Taken from the manifest where `init` has counted frames, else from the size of the files;
    opening a video could crash this process.
    """
    return _expected_frames(job) * (1 + len(job.tracks))


def _expected_frames(job: VideoJob) -> float:
    if job.frame_count_hint is not None:
        return job.frame_count_hint
    try:
        if job.path.is_dir():
            with os.scandir(_pictures_of(job.path)) as entries:
                return sum(1 for _ in entries)
        return job.path.stat().st_size / _BYTES_PER_FRAME
    except (OSError, ValueError):
        return 0.0  # whoever works on it will say what is wrong


def _pictures_of(folder: Path) -> Path:
    images = folder / "img"
    return images if images.is_dir() else folder


def _bytes_per_worker(jobs: Sequence[VideoJob], recipe: Recipe) -> int:
    known = [job.size_hint_hw for job in jobs if job.size_hint_hw is not None]
    height, width = max(known, key=lambda size: size[0] * size[1], default=_USUAL_SIZE_HW)
    megabytes = _WORKER_MB + recipe.propagation.memory_mb
    return megabytes * _BYTES_PER_MB + _PICTURES_HELD * height * width * 3


def _available_bytes() -> int:
    """Memory that can be had, within what a container allows."""
    available: int = psutil.virtual_memory().available
    for limit, used in _CGROUP_LIMITS:
        try:
            left = int(Path(limit).read_text()) - int(Path(used).read_text())
        except (OSError, ValueError):  # not there, or "max"
            continue
        available = min(available, left)
    return available


def workers_for_memory(jobs: Sequence[VideoJob], recipe: Recipe) -> int:
    """How many workers the free memory is enough for; at least 1.

    Parameters
    ----------
    jobs : sequence of VideoJob
        The videos: the largest picture that the manifest tells of counts, or Full HD.
    recipe : Recipe
        Says how many pictures may be held in going backward.
    """
    return max(1, int(_SHARE_OF_MEMORY * _available_bytes() / _bytes_per_worker(jobs, recipe)))
