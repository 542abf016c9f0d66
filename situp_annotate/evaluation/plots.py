"""Curves of the simulated annotator; matplotlib is loaded when one is drawn."""

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from situp_annotate.errors import OutputError, SitupError
from situp_annotate.evaluation.effort import THRESHOLDS
from situp_annotate.evaluation.effort_study import TargetResult

__all__ = ["draw_recalls", "require_matplotlib"]

_MOST_BOXES = 30
_DPI = 150


def require_matplotlib() -> None:
    """Make sure that curves can be drawn.

    Raises
    ------
    SitupError
        If matplotlib is not installed.
    """
    if find_spec("matplotlib") is None:
        raise SitupError(
            "Curves need matplotlib, which is not installed; install it with "
            "pip install 'situp-annotate[evaluate]', or leave out --plot."
        )


def draw_recalls(targets: Sequence[TargetResult], path: Path) -> None:
    """Draw mean recall against boxes drawn, a curve for each method, into a PNG.

    Where a target is finished, its last recall is kept on.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.6), layout="constrained")
    axes = figure.subplots(1, len(THRESHOLDS), sharey=True)
    for axis, threshold in zip(axes, THRESHOLDS, strict=True):
        for method in targets[0].methods:
            curve = _mean_recall(targets, method, threshold)
            axis.plot(range(1, len(curve) + 1), curve, label=method)
        axis.set(xlabel="boxes drawn", title=f"overlap ≥ {threshold}", xlim=(1, None), ylim=(0, 1))
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("recall in the other frames")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right center")
    try:
        figure.savefig(path, format="png", dpi=_DPI, metadata={"Software": None})
    except OSError as error:
        raise OutputError(f"{path}: cannot write here: {error.strerror or error}.") from error


def _mean_recall(targets: Sequence[TargetResult], method: str, threshold: float) -> list[float]:
    """Mean over the targets with 1, 2, 3 … boxes, as far as the longest goes."""
    runs = [target.methods[method].runs["worst"].recalls[threshold] for target in targets]
    longest = min(max(map(len, runs)), _MOST_BOXES)
    padded = [(run + run[-1:] * longest)[:longest] for run in runs]
    return [float(mean) for mean in np.mean(padded, axis=0)]
