"""Results and truth in MOT format, from files to scores: what the command runs."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

from situp_annotate.errors import OutputError, SitupError
from situp_annotate.evaluation.mot_scores import (
    MotScores,
    MotSequence,
    ScoreOptions,
    score_sequences,
)
from situp_annotate.formats.json_files import read_bytes, validate_json
from situp_annotate.formats.mot.importing import sequence_name
from situp_annotate.formats.mot.rows import NO_TRACK, MotRow, parse_mot
from situp_annotate.formats.staging import write_whole
from situp_annotate.formats.zipped import opened, read_text
from situp_annotate.results import BATCH_FILE, SUMMARY_FILE, run_folders

__all__ = ["MotOutcome", "MotPlan", "score_files"]

_RESULT = "mot.csv"
_TRUTH = "gt/gt.txt"
_MOST_NAMES = 5
"""In a message."""


@dataclass(frozen=True, slots=True)
class MotPlan:
    """What to score.

    Attributes
    ----------
    result : Path
        Output folder of a run, a folder with ``NAME.txt`` or ``NAME/mot.csv``, or one file.
    truth : Path
        One file, which may be CVAT's archive, or a folder with ``NAME.txt`` or
        ``NAME/gt/gt.txt``.
    options : ScoreOptions
        What counts.
    result_origin, truth_origin : int
        Coordinate of the picture's top-left corner, 0 or 1.
    """

    result: Path
    truth: Path
    options: ScoreOptions = field(default_factory=ScoreOptions)
    result_origin: int = 0
    truth_origin: int = 0


@dataclass(frozen=True, slots=True)
class MotOutcome:
    """What has come out.

    Attributes
    ----------
    plan : MotPlan
        What was scored.
    videos : dict of str to MotScores
        By name.
    combined : MotScores
        Of all videos.
    without_truth, without_result : tuple of str
        Names of what could not be scored.
    """

    plan: MotPlan
    videos: dict[str, MotScores]
    combined: MotScores
    without_truth: tuple[str, ...]
    without_result: tuple[str, ...]

    @property
    def notes(self) -> list[str]:
        """What to know of the scores, a sentence each."""
        notes = []
        if self.without_truth:
            notes.append(f"Not scored, since there is no truth of it: {_all(self.without_truth)}.")
        if self.without_result:
            notes.append(f"Not scored, since there is no result: {_all(self.without_result)}.")
        empty = [name for name, each in self.videos.items() if not each.boxes["truth_boxes"]]
        if empty:
            notes.append(f"No box of the truth counts, so that all shares are 0: {_all(empty)}.")
        return notes

    def as_dict(self) -> dict[str, Any]:
        """What is written as JSON."""
        plan = self.plan
        return {
            "protocol": {
                "scores": f"TrackEval {version('trackeval')}: HOTA, CLEAR, Identity",
                "iou": plan.options.iou,
                "hota_iou": "mean over 0.05, 0.1, 0.15 and so on to 0.95",
                "classes": list(plan.options.classes) or "all",
                "ignored_classes": list(plan.options.ignored_classes),
                "truth_flag_0": "left out",
                "frames": "counted from 1",
                "result_pixel_origin": plan.result_origin,
                "truth_pixel_origin": plan.truth_origin,
                "combined": "over the boxes of all videos, as TrackEval's COMBINED_SEQ",
            },
            "videos": {name: _plain(scores) for name, scores in self.videos.items()},
            "combined": _plain(self.combined),
            "without_truth": list(self.without_truth),
            "without_result": list(self.without_result),
        }


def score_files(plan: MotPlan, json_path: Path | None = None) -> MotOutcome:
    """Read, score and write.

    Parameters
    ----------
    plan : MotPlan
        What to score.
    json_path : Path or None
        File that gets all figures, whole or not at all.

    Raises
    ------
    SitupError
        If a file cannot be read or is not MOT, no result has truth, or TrackEval is not there.
    OutputError
        If the JSON file cannot be written, or would replace what is read.
    """
    results, truths = _results(plan.result), _truths(plan.truth)
    is_one = plan.truth.is_file() or (plan.truth / _TRUTH).is_file()
    if is_one and len(results) == 1:
        truths = dict(zip(results, truths.values(), strict=True))  # whatever it is called
    names = [name for name in results if name in truths]
    if not names:
        raise SitupError(
            f"{plan.result}: none of its videos ({_some(results)}) has truth in {plan.truth} "
            f"({_some(truths)}); give truth as NAME.txt or NAME/{_TRUTH} with the same names."
        )
    _refuse_source(json_path, [*results.values(), *truths.values()])
    sequences = [_sequence(name, results[name], truths[name], plan) for name in names]
    videos, combined = score_sequences(sequences, plan.options)
    outcome = MotOutcome(
        plan=plan,
        videos=videos,
        combined=combined,
        without_truth=tuple(name for name in results if name not in truths),
        without_result=tuple(name for name in truths if name not in results),
    )
    if json_path is not None:
        write_whole(json_path, json.dumps(outcome.as_dict(), indent=2) + "\n")
    return outcome


def _plain(scores: MotScores) -> dict[str, float]:
    return {key: number for group in asdict(scores).values() for key, number in group.items()}


def _shown(name: str) -> str:
    return name if name.isprintable() else ascii(name)


def _all(names: Sequence[str]) -> str:
    return ", ".join(map(_shown, names))


def _some(paths: Mapping[str, Path]) -> str:
    names = list(paths)
    return _all(names[:_MOST_NAMES]) + ", …" * (len(names) > _MOST_NAMES)


def _refuse_source(json_path: Path | None, sources: Sequence[Path]) -> None:
    if json_path is not None and json_path.resolve() in {path.resolve() for path in sources}:
        raise OutputError(
            f"{json_path}: this is one of the files to score; choose another place with --json."
        )


# ---- where the files are -------------------------------------------------------------------


def _results(place: Path) -> dict[str, Path]:
    """Files with results, by the name of the video."""
    if not (place / BATCH_FILE).is_file():
        return _found(place, _RESULT, f"NAME.txt or NAME/{_RESULT}, or the output of a run")
    files = {folder.name: folder / _RESULT for folder in run_folders(place)}
    for path in files.values():
        if not path.is_file():
            raise SitupError(
                f"{path}: not there; run again with --set outputs.mot=true, or write results with "
                "`situp-annotate export --format mot` and give their folder."
            )
    if not files:
        raise SitupError(f"{place}: this run has annotated no video.")
    return files


def _truths(place: Path) -> dict[str, Path]:
    return _found(place, _TRUTH, f"NAME.txt or NAME/{_TRUTH}")


def _found(place: Path, inner: str, wanted: str) -> dict[str, Path]:
    """Files of a folder in one of the two layouts, or the one that is given."""
    path = place if place.is_file() else place / inner
    if path.is_file():
        return {sequence_name(path, path): path}
    try:
        entries = sorted(place.iterdir())
    except OSError as error:
        raise SitupError(f"{place}: cannot be read: {error.strerror or error}.") from error
    found: dict[str, Path] = {}
    for entry in entries:
        nested = (entry / inner).is_file()
        if not nested and not (entry.suffix.lower() == ".txt" and entry.is_file()):
            continue
        name, path = (entry.name, entry / inner) if nested else (entry.stem, entry)
        if name in found:
            raise SitupError(f"{path}: {found[name]} is of the same video; keep one of them.")
        found[name] = path
    if not found:
        raise SitupError(f"{place}: nothing to score here; give a folder with {wanted}.")
    return found


# ---- what is in them -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Summary:
    """What is wanted of a video's ``summary.json``."""

    frames: int


def _rows(path: Path, pixel_origin: int) -> list[MotRow]:
    with opened(path, _TRUTH) as file:
        rows = parse_mot(read_text(file), str(file), pixel_origin=pixel_origin)
    for row in rows:
        if row.track_id == NO_TRACK:
            raise SitupError(
                f"{path}: a box in frame {row.frame + 1} has the id −1, of no track; give each "
                "object an id of its own."
            )
    return rows


def _sequence(name: str, result: Path, truth: Path, plan: MotPlan) -> MotSequence:
    sequence = MotSequence(name, _rows(result, plan.result_origin), _rows(truth, plan.truth_origin))
    asked = plan.options.classes or plan.options.ignored_classes
    if asked and any(row.class_number is None for row in sequence.truth):
        raise SitupError(
            f"{truth}: there are rows without a class, which only ground truth with nine columns "
            "has; leave out --class and --ignore-class."
        )
    summary = result.parent / SUMMARY_FILE
    if result.name == _RESULT and summary.is_file():
        _check_length(sequence, truth, _frame_count(summary))
    return sequence


def _frame_count(summary: Path) -> int:
    wanted = "what `situp-annotate run` writes"
    return validate_json(summary, read_bytes(summary), _Summary, wanted=wanted).frames


def _check_length(sequence: MotSequence, truth: Path, frames: int) -> None:
    last = max((row.frame for row in sequence.truth), default=-1) + 1
    if last > frames:
        raise SitupError(
            f"{truth}: boxes go up to frame {last}, but the video {sequence.name} has {frames} "
            "frames, counted from 1; give the truth of this video."
        )
