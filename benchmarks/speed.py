"""How fast the tracker is, beside OpenCV's, and where its time goes.

    python benchmarks/speed.py --sequences FOLDER --json FILE --figure FILE.svg [--tracker PRESET]

FOLDER holds sequences in OTB layout. Every tracker runs in a process of its own, pinned to one
core and to one thread, on frames that are decoded beforehand; the trackers take turns, so that a
machine whose speed varies is as fair to one as to another. The first run is over the whole
sequence and gives the accuracy; timed runs must repeat its boxes, and the median of several
counts. TrackerCSRT and TrackerKCF (with detect_thresh = 0, since at its default it gives up and
then runs idle) come from opencv-contrib-python-headless, which goes into a virtual environment
of its own, benchmarks/.peers.
"""

import json
import os
import statistics
import subprocess
import sys
import time
import venv
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from unittest.mock import patch

import click
import numpy as np
import numpy.typing as npt
from tqdm import tqdm

from situp_annotate.compiling import compile_kernels
from situp_annotate.evaluation import OtbSequence, OtbTarget, evaluate_one_pass, find_sequences
from situp_annotate.propagation import FramesInMemory, TrackerFactory, propagate
from situp_annotate.trackers.variants import variant_params
from situp_annotate.tracking import SitupTracker, TrackerParams, pyramid, window
from situp_annotate.tracking import target as tracking_target
from situp_annotate.tracking.correlation import CorrelationFilter, Model, respond
from situp_annotate.tracking.features import add_colors
from situp_annotate.tracking.filters import BackgroundAwareFilter
from situp_annotate.tracking.fourier import invert, transform
from situp_annotate.tracking.hog import fhog
from situp_annotate.tracking.sampling import sample_window
from situp_annotate.types import BoundingBox, Frame, Image, Keyframe, Track
from situp_annotate.video import open_video

Kernel = Callable[..., object]

_HERE = Path(__file__).parent
_CSRT, _KCF = "opencv-csrt", "opencv-kcf"
_STAGES = ("halve", "sample", "HOG", "colour", "transform", "correlate", "respond", "update")


@dataclass(frozen=True)
class Run:
    """One run of one tracker: seconds a frame and boxes, counted from 0."""

    seconds: float
    boxes: list[tuple[float, float, float, float]]


@dataclass
class Figures:
    """What one target gave."""

    name: str
    size: tuple[float, float]
    template: tuple[int, int]
    stages_ms: dict[str, float]
    ms: dict[str, float]
    auc: dict[str, float]
    precision: dict[str, float]

    def ratio(self, peer: str) -> float:
        """How many times as fast ours is as a peer."""
        ours = next(name for name in self.ms if name not in (_CSRT, _KCF))
        return self.ms[peer] / self.ms[ours]


def peers_python() -> Path:
    """Interpreter with OpenCV's contributed trackers; made when missing."""
    folder = _HERE / ".peers"
    python = folder / "bin" / "python"
    if not python.exists():
        venv.create(folder, with_pip=True)
        packages = ["opencv-contrib-python-headless", "numpy"]
        subprocess.run([python, "-m", "pip", "install", "--quiet", *packages], check=True)
    return python


def pictures_of(sequence: OtbSequence) -> Path:
    """Folder with the pictures of a sequence."""
    return sequence.folder / "img"


def run(name: str, sequence: OtbSequence, target: OtbTarget, frames: int | None) -> Run:
    """Run a tracker in a process of its own."""
    box = target.first_box
    command: list[object] = [
        peers_python() if name in (_CSRT, _KCF) else sys.executable, _HERE / "time_tracker.py",
        "--tracker", name, "--pictures", pictures_of(sequence), "--core", core(0),
        "--box", box.x, box.y, box.width, box.height,
    ]  # fmt: skip
    command += [] if frames is None else ["--frames", frames]
    answer = subprocess.run(
        [str(word) for word in command], check=True, capture_output=True, text=True
    )
    found = json.loads(answer.stdout)
    return Run(statistics.fmean(found["seconds"]), [tuple(box) for box in found["boxes"]])


def core(number: int) -> int:
    """One of the cores that this process may use."""
    cores = sorted(_CORES)
    return cores[number % len(cores)]


_CORES = os.sched_getaffinity(0)


class StageClock:
    """Adds up the time that the tracker spends in its stages."""

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(_STAGES, 0.0)

    def _timed(self, stage: str, function: Kernel) -> Kernel:
        def call(*arguments: object) -> object:
            start = time.perf_counter()
            result = function(*arguments)
            self.seconds[stage] += time.perf_counter() - start
            return result

        return call

    def measure(self, work: Callable[[], None]) -> None:
        """Do work with every stage timed."""
        sample = self._timed("sample", sample_window)
        hog = self._timed("HOG", fhog)
        colors = self._timed("colour", add_colors)
        transformed = self._timed("transform", transform)

        correlate = self._timed("correlate", respond)
        back = self._timed("respond", invert)

        def search_windows(
            picture: Image,
            center_yx: tuple[float, float],
            steps_yx: npt.NDArray[np.float64],
            plan: window.WindowPlan,
            model: Model,
            spectra: window.Real,
            responses: window.Real,
        ) -> None:
            """As the kernel of this name, stage by stage."""
            cells, gradients = plan.features, plan.features.orientations
            rows, columns = cells.cosine_window.shape
            shape = (rows, 2, columns // 2 + 1, len(responses))
            responses_f = np.empty(shape, np.float32)
            for n, (step_y, step_x) in enumerate(steps_yx):
                sample(picture, center_yx, (step_y, step_x), plan.window)
                hog(plan.window, gradients, cells.cell_size, cells.cosine_window, plan.maps)
                colors(plan.window, cells, plan.maps)
                spectrum = spectra[n % len(spectra)]
                transformed(plan.maps, plan.transform, spectrum)
                if len(responses):
                    correlate(spectrum, model, responses_f[..., n])
            if len(responses):
                back(responses_f, plan.transform, responses)

        parts = (
            (pyramid, "halve", "halve"),
            (tracking_target, "apce", "respond"),
            (tracking_target, "find_peak", "respond"),
            (CorrelationFilter, "learn", "update"),
            (BackgroundAwareFilter, "learn", "update"),
        )
        with ExitStack() as stack:
            stack.enter_context(patch.object(tracking_target, "search_windows", search_windows))
            for owner, name, stage in parts:
                timed = self._timed(stage, getattr(owner, name))
                stack.enter_context(patch.object(owner, name, timed))
            work()


def stages_of(
    images: list[Image], box: BoundingBox, params: TrackerParams
) -> tuple[dict[str, float], tuple[int, int]]:
    """Milliseconds an update by stage, and the template's rows and columns."""
    tracker, clock = SitupTracker(params), StageClock()
    tracker.init(images[0], box)
    tracker.update(images[0])

    def work() -> None:
        for image in images[1:]:
            tracker.update(image)

    clock.measure(work)  # compiles the stages apart
    clock.seconds = dict.fromkeys(_STAGES, 0.0)
    clock.measure(work)
    rows, columns = window.SearchWindow(images[0].shape, box, params).grid_hw
    return {stage: 1e3 * seconds / (len(images) - 1) for stage, seconds in clock.seconds.items()}, (
        rows,
        columns,
    )


def images_of(sequence: OtbSequence, count: int) -> list[Image]:
    """First pictures of a sequence, decoded as ``situp-annotate run`` does."""
    with open_video(sequence.folder) as source:
        return [frame.image for frame, _ in zip(source, range(count), strict=False)]


def compare(
    ours: str,
    sequence: OtbSequence,
    target: OtbTarget,
    frames: int,
    repeats: int,
    advance: Callable[[], object],
) -> Figures:
    """Time one of ours and OpenCV's trackers on one target, in turns."""
    names = (ours, _CSRT, _KCF)
    ms: dict[str, list[float]] = {name: [] for name in names}
    whole = {}
    for name in names:
        whole[name] = run(name, sequence, target, None)
        advance()
    for _ in range(repeats):
        for name in names:
            timed = run(name, sequence, target, frames)
            ms[name].append(1e3 * timed.seconds)
            if name == ours and timed.boxes != whole[name].boxes[: len(timed.boxes)]:
                raise click.ClickException(f"{target.name}: two runs gave different boxes.")
            advance()
    scores = {
        name: evaluate_one_pass(np.add(each.boxes, [1, 1, 0, 0]), target.truth)
        for name, each in whole.items()
    }
    images = images_of(sequence, frames)
    stages, template = stages_of(images, target.first_box, variant_params(ours))
    return Figures(
        name=target.name,
        size=(target.first_box.width, target.first_box.height),
        template=template,
        stages_ms=stages,
        ms={name: statistics.median(times) for name, times in ms.items()},
        auc={name: score.auc for name, score in scores.items()},
        precision={name: score.precision for name, score in scores.items()},
    )


def tracks_of(box: BoundingBox, count: int) -> list[Track]:
    """Tracks on boxes of one size, side by side around the first."""
    return [
        Track(
            number + 1,
            "target",
            (Keyframe(0, BoundingBox(box.x + 3 * number, box.y, box.width, box.height)),),
        )
        for number in range(count)
    ]


def seconds_of(images: list[Image], tracks: list[Track], cores: int, make: TrackerFactory) -> float:
    """Seconds to follow tracks through decoded frames on a number of cores."""
    os.sched_setaffinity(0, {core(number) for number in range(cores)})
    footage = FramesInMemory([Frame(index, 0, image) for index, image in enumerate(images)])
    start = time.perf_counter()
    propagate(footage, tracks, tracker=make, threads=cores)
    elapsed = time.perf_counter() - start
    os.sched_setaffinity(0, _CORES)
    return elapsed


def threads_ratio(
    images: list[Image], box: BoundingBox, repeats: int, make: TrackerFactory
) -> float:
    """How many times as fast two cores follow four targets as one core does."""
    tracks = tracks_of(box, 4)
    seconds_of(images[:3], tracks, 2, make)
    ratios = [
        seconds_of(images, tracks, 1, make) / seconds_of(images, tracks, 2, make)
        for _ in range(repeats)
    ]
    return statistics.median(ratios)


def growth(images: list[Image], make: TrackerFactory) -> dict[str, list[tuple[float, float]]]:
    """Milliseconds a frame against the template's area in cells and the number of targets."""
    height, width = images[0].shape[:2]
    by_area = []
    for side in (8, 12, 16, 24, 32, 48, 64, 80, 96):
        box = BoundingBox((width - side) / 2, (height - side) / 2, side, side)
        cells = (2.5 * side // 4) ** 2
        seconds = min(seconds_of(images, tracks_of(box, 1), 1, make) for _ in range(3))
        by_area.append((cells, 1e3 * seconds / len(images)))
    by_targets = []
    for count in (1, 2, 4, 8, 16, 32):
        box = BoundingBox(width / 2 - 50, height / 2 - 16, 32, 32)
        seconds = seconds_of(images, tracks_of(box, count), 1, make)
        by_targets.append((float(count), 1e3 * seconds / len(images)))
    return {"cells": by_area, "targets": by_targets}


def draw(curves: dict[str, list[tuple[float, float]]], path: Path) -> None:
    """Draw how cost grows."""
    import matplotlib as mpl

    mpl.use("svg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    labels = {"cells": "cells of the template", "targets": "targets of 32×32 pixels"}
    for axis, (name, points) in zip(axes, curves.items(), strict=True):
        axis.plot(*zip(*points, strict=True), marker="o")
        axis.set(xlabel=labels[name], ylabel="ms a frame, one core", xlim=(0, None), ylim=(0, None))
        axis.grid(alpha=0.3)
    figure.savefig(path, metadata={"Date": None})


def geometric_mean(values: Iterator[float]) -> float:
    """Geometric mean."""
    return statistics.geometric_mean(values)


def report(results: list[Figures]) -> None:
    """Print the tables of the README."""
    print("| target | size | template | " + " | ".join(_STAGES) + " |")
    print("|---" * (3 + len(_STAGES)) + "|")
    for each in results:
        stages = " | ".join(f"{each.stages_ms[stage]:.2f}" for stage in _STAGES)
        size = "×".join(f"{number:g}" for number in each.size)
        print(f"| {each.name} | {size} | {each.template[1]}×{each.template[0]} | {stages} |")
    print()
    names = list(results[0].ms)
    scores = [f"{score}: {name}" for score in ("AUC", "precision") for name in names]
    print(f"| target | fps | ÷ CSRT | ÷ KCF | {' | '.join(scores)} |")
    print("|---" * (4 + len(scores)) + "|")
    for each in results:
        figures = [f"{score[name]:.3f}" for score in (each.auc, each.precision) for name in names]
        print(
            f"| {each.name} | {1e3 / each.ms[names[0]]:.0f} | {each.ratio(_CSRT):.1f} "
            f"| {each.ratio(_KCF):.2f} | {' | '.join(figures)} |"
        )


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path), required=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
@click.option("--figure", type=click.Path(path_type=Path), help="draw how cost grows into this SVG")
@click.option("--tracker", default="situp", show_default=True, help="which of our presets")
@click.option("--frames", default=60, show_default=True, help="frames of a timed run")
@click.option("--repeats", default=3, show_default=True, help="timed runs of each tracker")
def main(
    sequences: Path, json_path: Path, figure: Path | None, tracker: str, frames: int, repeats: int
) -> None:
    """Measure, print the tables and write the figures."""
    compile_kernels()
    peers_python()
    targets = [(each, target) for each in find_sequences(sequences) for target in each.targets]
    steps = len(targets) * 3 * (1 + repeats)
    with tqdm(total=steps, unit="run") as bar:
        results = [
            compare(tracker, sequence, target, frames, repeats, partial(bar.update, 1))
            for sequence, target in targets
        ]
    make = partial(SitupTracker, variant_params(tracker))
    ratios = [
        threads_ratio(images_of(sequence, frames), target.first_box, repeats, make)
        for sequence, target in targets
    ]
    report(results)
    bars = {
        "csrt_ratio": geometric_mean(each.ratio(_CSRT) for each in results),
        "csrt_ratio_least": min(each.ratio(_CSRT) for each in results),
        "kcf_ratio": geometric_mean(each.ratio(_KCF) for each in results),
        "threads_ratio": geometric_mean(iter(ratios)),
    }
    curves = growth(images_of(targets[0][0], frames), make)
    if figure is not None:
        draw(curves, figure)
    print(json.dumps(bars, indent=2))
    content = {"bars": bars, "growth": curves, "targets": [asdict(each) for each in results]}
    json_path.write_text(json.dumps(content, indent=2) + "\n")


if __name__ == "__main__":
    main()
