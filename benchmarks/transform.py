"""The tracker's transform beside scipy.fft's, on the templates of real sequences.

    python benchmarks/transform.py --sequences FOLDER --json FILE

Both transform the 42 feature maps of a window (32 of a grey one) to half spectra, in single
precision and on one thread, in turns; the median counts. scipy.fft gets the maps in the order it
likes best, each map in one piece.
"""

import json
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import click
import numpy as np
from scipy import fft

from situp_annotate.evaluation import find_sequences
from situp_annotate.tracking.fourier import plan_transform, transform
from situp_annotate.tracking.params import TrackerParams
from situp_annotate.tracking.window import SearchWindow
from situp_annotate.video import open_video

_REPEATS = 200


def seconds(work: Callable[[], object]) -> float:
    """Seconds of one call."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def ratio_of(rows: int, columns: int, channels: int) -> float:
    """How many times as fast as scipy.fft."""
    maps = np.random.default_rng(0).normal(size=(columns, rows, channels)).astype(np.float32)
    planes = np.ascontiguousarray(maps.T)
    plan = plan_transform((rows, columns), channels)
    out = np.empty((rows, 2, columns // 2 + 1, channels), np.float32)
    transform(maps, plan, out)
    np.testing.assert_allclose(
        out[:, 0] + 1j * out[:, 1], np.moveaxis(fft.rfft2(planes), 0, -1), atol=1e-3
    )
    pairs = [
        (seconds(lambda: fft.rfft2(planes)), seconds(lambda: transform(maps, plan, out)))
        for _ in range(_REPEATS)
    ]
    return statistics.median(general for general, _ in pairs) / statistics.median(
        ours for _, ours in pairs
    )


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path), required=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
def main(sequences: Path, json_path: Path) -> None:
    """Measure, print a table and write the figures."""
    ratios = {}
    print("| target | template | channels | times as fast as scipy.fft |")
    print("|---|---|---|---|")
    for sequence in find_sequences(sequences):
        with open_video(sequence.folder) as source:
            shape = next(iter(source)).image.shape
        for target in sequence.targets:
            window = SearchWindow(shape, target.first_box, TrackerParams())
            (rows, columns), channels = window.grid_hw, window.plan.features.channels
            ratios[target.name] = ratio_of(rows, columns, channels)
            print(f"| {target.name} | {columns}×{rows} | {channels} | {ratios[target.name]:.1f} |")
    bars = {"scipy_ratio": statistics.geometric_mean(ratios.values())}
    print(json.dumps(bars, indent=2))
    json_path.write_text(json.dumps({"bars": bars, "targets": ratios}, indent=2) + "\n")


if __name__ == "__main__":
    main()
