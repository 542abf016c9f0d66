"""Success and precision plots; matplotlib is loaded when one is drawn."""

from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

from situp_annotate.evaluation.evaluation_report import Evaluation
from situp_annotate.evaluation.metrics import PRECISION_PIXELS, PRECISION_THRESHOLDS, THRESHOLDS
from situp_annotate.evaluation.scores import Scores
from situp_annotate.formats.staging import write_whole

__all__ = ["can_draw", "draw_curves"]

_DPI = 150
_IN_LEGEND = 6
"""Trackers above which the legend stands beside the axes."""

_STYLES = ("-", "--", "-.", ":")


class _Plot(NamedTuple):
    title: str
    x_label: str
    y_label: str
    thresholds: Sequence[float]
    curve: Callable[[Scores], Sequence[float]]
    figure: Callable[[Scores], float]
    legend: str
    marked: float | None = None


_PLOTS: Mapping[str, _Plot] = {
    "success": _Plot(
        "Success plot",
        "overlap threshold",
        "share of frames above",
        THRESHOLDS.tolist(),
        lambda scores: scores.success_curve,
        lambda scores: scores.auc,
        "AUC",
    ),
    "precision": _Plot(
        "Precision plot",
        "centre error threshold in pixels",
        "share of frames within",
        PRECISION_THRESHOLDS.tolist(),
        lambda scores: scores.precision_curve,
        lambda scores: scores.precision,
        f"at {PRECISION_PIXELS} px",
        PRECISION_PIXELS,
    ),
}


def can_draw() -> bool:
    """Whether matplotlib is installed."""
    return find_spec("matplotlib") is not None


def draw_curves(evaluation: Evaluation, protocol: str, folder: Path) -> list[Path]:
    """Draw both plots of a protocol, over the targets that all its trackers have boxes of.

    Parameters
    ----------
    evaluation : Evaluation
        With a tracker of this protocol.
    protocol : str
        The files of ``"ope"`` are called ``success`` and ``precision``; others have its name
        after that, as in ``success_tre``.
    folder : Path
        Gets a PNG and an SVG of each.

    Returns
    -------
    list of Path
        What was written; nothing if there is no target that all have.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    names = evaluation.common(protocol)
    if not names:
        return []
    written = []
    for name, plot in _PLOTS.items():
        curves = {
            tracker.name: scores
            for tracker in evaluation.of_protocol(protocol)
            if (scores := tracker.mean(protocol, names)) is not None
        }
        count = f"{len(names)} target" + ("" if len(names) == 1 else "s")
        title = f"{plot.title}, {protocol.upper()}, {count}"
        stem = name if protocol == "ope" else f"{name}_{protocol}"
        figure = _figure(plot, curves, title)
        for suffix in ("png", "svg"):
            path = folder / f"{stem}.{suffix}"
            write_whole(path, _picture(figure, suffix))
            written.append(path)
    return written


def _figure(plot: _Plot, curves: Mapping[str, Scores], title: str) -> Any:  # noqa: ANN401
    from matplotlib.figure import Figure

    beside = len(curves) > _IN_LEGEND
    figure = Figure(figsize=(9 if beside else 6, 4.5), layout="constrained")
    axis = figure.subplots()
    places = {name: place for place, name in enumerate(curves)}  # a tracker keeps its colour
    for name in sorted(curves, key=lambda each: plot.figure(curves[each]), reverse=True):
        scores, place = curves[name], places[name]
        label = f"{name} [{plot.figure(scores):.3f}]".replace("$", r"\$")
        style = _STYLES[place // 10 % len(_STYLES)]
        axis.plot(plot.thresholds, plot.curve(scores), style, color=f"C{place % 10}", label=label)
    axis.set(xlabel=plot.x_label, ylabel=plot.y_label, title=title, ylim=(0, 1))
    axis.set_xlim(plot.thresholds[0], plot.thresholds[-1])
    axis.grid(alpha=0.3)
    if plot.marked is not None:
        axis.axvline(plot.marked, color="0.5", linewidth=0.8, linestyle=":")
    if beside:
        figure.legend(title=plot.legend, loc="outside right upper", fontsize="small")
    else:
        corner = "lower left" if plot.legend == "AUC" else "lower right"
        axis.legend(title=plot.legend, loc=corner, fontsize="small")
    return figure


def _picture(figure: Any, suffix: str) -> bytes:  # noqa: ANN401
    from matplotlib import rc_context

    content = BytesIO()
    metadata = {"Software": None} if suffix == "png" else {"Date": None}
    with rc_context({"svg.hashsalt": "situp-annotate"}):
        figure.savefig(content, format=suffix, dpi=_DPI, metadata=metadata)
    return content.getvalue()
