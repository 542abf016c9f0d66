"""What was known of boxes and how good they were: from this, confidence is fitted and judged."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import numpy.typing as npt

from situp_annotate.evaluation.effort import BUDGETS, Subject
from situp_annotate.evaluation.picks import Situation
from situp_annotate.propagation import Stretch
from situp_annotate.propagation.confidence import design_matrix, feature_names
from situp_annotate.types import Provenance

__all__ = ["SampleCollector", "Samples"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Samples:
    """Boxes that nobody drew, in frames where the object is there; n of them.

    Attributes
    ----------
    features : ndarray
        (n, f), as :func:`~situp_annotate.propagation.confidence.design_matrix` gives them.
    overlap : ndarray
        (n,), with the truth, in [0, 1]; 0 where the object was given up as lost.
    confidence : ndarray
        (n,), in [0, 1].
    boxes : ndarray of int
        (n,), how many boxes the person had drawn.
    pick : ndarray of str
        (n,), how frames were picked, ``"worst"`` or ``"suggested"``.
    target : ndarray of str
        (n,), the target's name.
    """

    features: Array
    overlap: Array
    confidence: Array
    boxes: npt.NDArray[np.int64]
    pick: npt.NDArray[np.str_]
    target: npt.NDArray[np.str_]

    @classmethod
    def joined(cls, parts: "Sequence[Samples]") -> "Samples":
        """All samples of several; of none, no samples."""
        empty = cls(
            np.empty((0, len(feature_names()))), np.empty(0), np.empty(0), np.empty(0, np.int64),
            np.empty(0, np.str_), np.empty(0, np.str_),
        )  # fmt: skip
        names = [field.name for field in fields(cls)]
        return cls(*(np.concatenate([getattr(s, name) for s in (empty, *parts)]) for name in names))

    @classmethod
    def load(cls, path: Path) -> "Samples":
        """Read what :meth:`save` wrote."""
        with np.load(path) as archive:
            return cls(**archive)

    def save(self, path: Path) -> None:
        """Write an ``.npz`` with an array for each attribute."""
        with path.open("wb") as file:
            np.savez_compressed(file, **{f.name: getattr(self, f.name) for f in fields(self)})

    def where(self, kept: npt.NDArray[np.bool_]) -> "Samples":
        """Those for which the flag, (n,), is set."""
        return Samples(*(getattr(self, field.name)[kept] for field in fields(self)))


class SampleCollector:
    """Observes a simulation and collects samples when 1, 2, 3, 5 and 10 boxes are drawn.

    Parameters
    ----------
    subject : Subject
        The target.
    pick : str
        How frames are picked.
    """

    def __init__(self, subject: Subject, pick: str) -> None:
        self._subject = subject
        self._pick = pick
        self._parts: list[Samples] = []

    def __call__(self, situation: Situation) -> None:
        """Collect, if a budget is met."""
        if len(situation.keyframes) in BUDGETS:
            self._parts += [
                self._take(stretch, situation) for stretch in situation.labels.stretches
            ]

    def samples(self) -> Samples:
        """Everything so far."""
        return Samples.joined(self._parts)

    def _take(self, stretch: Stretch, situation: Situation) -> Samples:
        human = np.array([each is Provenance.HUMAN for each in stretch.provenances])
        frames = slice(stretch.start, stretch.stop)
        kept = self._subject.present[frames] & ~human
        count = int(kept.sum())
        return Samples(
            design_matrix(stretch.evidence)[kept],
            situation.overlaps[frames][kept],
            stretch.confidence[kept],
            np.full(count, len(situation.keyframes)),
            np.full(count, self._pick),
            np.full(count, self._subject.name),
        )
