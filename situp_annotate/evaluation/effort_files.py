"""The simulated annotator from a folder of sequences to files: what the command runs."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from tqdm import tqdm

from situp_annotate.evaluation.datasets import find_sequences
from situp_annotate.evaluation.effort_report import effort_document
from situp_annotate.evaluation.effort_study import Settings, load_samples, run_study
from situp_annotate.evaluation.effort_tables import effort_tables
from situp_annotate.evaluation.plots import draw_recalls, require_matplotlib
from situp_annotate.formats.staging import write_whole

__all__ = ["Effort", "measure_effort", "parts_folder"]


@dataclass(frozen=True, slots=True)
class Effort:
    """What came out.

    Attributes
    ----------
    bars : dict of str to float
        See :func:`~situp_annotate.evaluation.effort_report.bars`.
    lines : tuple of str
        Tables in Markdown.
    """

    bars: dict[str, float]
    lines: tuple[str, ...]


def parts_folder(json_path: Path) -> Path:
    """Folder of the results of each target, from which a run that was interrupted goes on."""
    return json_path.with_name(json_path.name + ".parts")


def measure_effort(
    sequences: Path,
    json_path: Path,
    settings: Settings,
    *,
    plot: Path | None = None,
    workers: int = 1,
) -> Effort:
    """Simulate, with a progress bar on stderr, and write the figures.

    Parameters
    ----------
    sequences : Path
        Folder with sequences in OTB layout.
    json_path : Path
        File to write, replaced if it is there. Results of each target stay in a folder beside it
        whose name ends in ``.parts``.
    settings : Settings
        What is simulated.
    plot : Path, optional
        PNG to draw recall against boxes in.
    workers : int
        Targets at a time, a process each.

    Raises
    ------
    SitupError
        If there is no sequence, a ground truth cannot be read, or a plot is asked for and
        matplotlib is not installed.
    """
    if plot is not None:
        require_matplotlib()
    found = find_sequences(sequences)
    parts = parts_folder(json_path)
    count = sum(len(sequence.targets) for sequence in found)
    with tqdm(total=count, unit="target", disable=None, dynamic_ncols=True) as bar:
        targets = run_study(
            found, parts, settings, workers=workers, on_target=lambda _: bar.update(1)
        )
    samples = load_samples(parts, [target.name for target in targets])
    document = effort_document(targets, samples, asdict(settings))
    write_whole(json_path, json.dumps(document, indent=2) + "\n")
    if plot is not None:
        draw_recalls(targets, plot)
    return Effort(document["bars"], tuple(effort_tables(targets)))
