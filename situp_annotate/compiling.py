"""Compile the tracker's kernels once, however many processes start at a time.

Numba compiles a function when it is first called and keeps the machine code in a folder beside
the package, or in the user's cache where that cannot be written. Processes that start together
would all compile the same; here the first does, and the others wait for it.
"""

import hashlib
import platform
from pathlib import Path

import llvmlite.binding
import numba
import numpy as np
from filelock import FileLock

from situp_annotate.tracking import SitupTracker, TrackerParams, hog
from situp_annotate.types import BoundingBox

__all__ = ["compile_kernels", "kernels_are_compiled", "load_kernels"]


_EVERY_KERNEL = (
    TrackerParams(),
    TrackerParams(scale_search="filter"),
    TrackerParams(grayscale=True),
)
"""Settings that need all kernels between them."""


def _marker() -> Path:
    """File that says, beside the machine code, that all of it is there.

    Its name depends on all that Numba recompiles for: the sources, its version, the processor.
    """
    sources = sorted(Path(hog.__file__).parent.glob("*.py"))
    stamps = [(path.name, path.stat().st_mtime_ns, path.stat().st_size) for path in sources]
    processor = (platform.machine(), llvmlite.binding.get_host_cpu_name())
    state = repr((stamps, processor, numba.__version__, platform.python_version()))
    digest = hashlib.sha256(state.encode()).hexdigest()[:16]
    return Path(hog.fhog.stats.cache_path) / f"kernels-{digest}.compiled"


def kernels_are_compiled() -> bool:
    """Whether the tracker can start without compiling."""
    return _marker().exists()


def compile_kernels() -> None:
    """Compile whatever is not compiled yet; return at once if nothing is to be done."""
    marker = _marker()
    if marker.exists():
        return
    marker.parent.mkdir(parents=True, exist_ok=True)
    with FileLock(marker.with_suffix(".lock")):
        if not marker.exists():
            _call_all()
            marker.touch()


def load_kernels() -> None:
    """Load the machine code of all kernels into this process, compiling it if need be."""
    compile_kernels()
    _call_all()


def _call_all() -> None:
    for image in (np.zeros((64, 64, 3), np.uint8), np.zeros((64, 64), np.uint8)):
        for side in (16, 120):  # at full and at half size
            for params in _EVERY_KERNEL:
                tracker = SitupTracker(params)
                tracker.init(image, BoundingBox(0, 0, side, side))
                tracker.update(image)
