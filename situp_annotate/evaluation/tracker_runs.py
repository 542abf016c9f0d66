"""Run a tracker on a target, from one or more starts; only its own work is timed."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from situp_annotate.errors import SitupError
from situp_annotate.evaluation.benchmark import Target
from situp_annotate.evaluation.metrics import evaluate_one_pass
from situp_annotate.evaluation.otb_frames import scored_pictures
from situp_annotate.evaluation.robustness import shifted_boxes, temporal_starts
from situp_annotate.evaluation.scores import Scores, pooled_scores
from situp_annotate.limits import Limits
from situp_annotate.tracking import Tracker
from situp_annotate.types import BoundingBox, Image
from situp_annotate.video.image_folder import ImageFolderDecoder

__all__ = ["PROTOCOLS", "Run", "run_target", "score_runs"]

PROTOCOLS = ("ope", "tre", "sre")
"""One-pass evaluation; temporal and spatial robustness evaluation."""

Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Run:
    """One run to the end of the sequence.

    Attributes
    ----------
    first : int
        Frame that it begins in, from 0, of those that count.
    boxes : tuple of tuple of float
        x, y, width, height, counted from 1, of each frame from there on.
    seconds : float
        What ``init`` and all ``update`` took, without decoding.
    """

    first: int
    boxes: tuple[Box, ...]
    seconds: float


class _Pictures:
    """The pictures of the frames that count."""

    def __init__(self, target: Target) -> None:
        assert target.folder is not None, "checked before anything is run"
        self._decoder = ImageFolderDecoder(target.folder, max_pixels=Limits().max_pixels)
        paths, count = self._decoder.paths, len(target.truth)
        self._places = scored_pictures(target.sequence, paths, count)
        if len(self._places) < count:
            raise SitupError(
                f"{target.folder}: {len(paths)} pictures, but the truth of {target.name} has "
                f"{count} rows; give a picture for each row."
            )

    def __getitem__(self, frame: int) -> Image:
        return self._decoder.read(self._places[frame])


def run_target(make: Callable[[], Tracker], target: Target, protocol: str) -> list[Run]:
    """Run a tracker on a target.

    Parameters
    ----------
    make : callable
        Makes a tracker; called for each run.
    target : Target
        With a folder of pictures.
    protocol : str
        One of ``PROTOCOLS``.

    Raises
    ------
    SitupError
        If a picture is missing or cannot be read, the first row of the truth is no box, or the
        tracker fails.
    """
    pictures = _Pictures(target)
    return [
        _run(make(), target, pictures, first, box)
        for first, box in _starts(target, pictures, protocol)
    ]


def score_runs(runs: Sequence[Run], target: Target) -> Scores:
    """Scores of all frames of all runs; each run's first frame counts as the truth."""
    return pooled_scores(
        [evaluate_one_pass(np.array(run.boxes), target.truth[run.first :]) for run in runs]
    )


def _starts(target: Target, pictures: _Pictures, protocol: str) -> Iterator[tuple[int, Box]]:
    if protocol == "tre":
        starts = temporal_starts(target.truth)
        if not starts:
            raise SitupError(
                f"{target.folder}: the truth of {target.name} has no box to begin with."
            )
        yield from ((frame, _row(target, frame)) for frame in starts)
    elif protocol == "sre":
        height, width = pictures[0].shape[:2]
        yield from ((0, box) for box in shifted_boxes(_row(target, 0), (height, width)))
    else:
        yield 0, _row(target, 0)


def _row(target: Target, frame: int) -> Box:
    x, y, width, height = (float(number) for number in target.truth[frame])
    if not (np.isfinite([x, y]).all() and width > 0 and height > 0):
        raise SitupError(
            f"{target.folder}: the first row of the truth of {target.name} is no box; begin the "
            f"sequence where its target is to be seen."
        )
    return x, y, width, height


def _run(tracker: Tracker, target: Target, pictures: _Pictures, first: int, box: Box) -> Run:
    x, y, width, height = box
    boxes, seconds = [box], 0.0
    for frame in range(first, len(target.truth)):
        image = pictures[frame]
        begun = perf_counter()
        try:
            if frame == first:
                tracker.init(image, BoundingBox(x - 1, y - 1, width, height))
                seconds += perf_counter() - begun
                continue
            found = tracker.update(image).box
        except Exception as error:  # trackers are anybody's code
            raise SitupError(
                f"{target.name}: the tracker fails in frame {frame}: "
                f"{type(error).__name__}: {error}"
            ) from error
        seconds += perf_counter() - begun
        boxes.append((found.x + 1, found.y + 1, found.width, found.height))
    return Run(first, tuple(boxes), seconds)
