"""One pass of a tracker over a stretch of video, from a keyframe on, in either direction."""

import statistics
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from situp_annotate.tracking import Estimate, SitupTracker, Tracker
from situp_annotate.types import BoundingBox, Image, Keyframe

__all__ = ["Follower", "Pass", "TrackerFactory", "peak_evidence"]

Array = npt.NDArray[np.float64]

TrackerFactory = Callable[[], Tracker]
"""Makes a fresh tracker for a target; such as ``SitupTracker`` itself."""

_USUAL_PEAK = 0.25
_EVIDENCE_PER_PEAK = 20.0
_MOST_EVIDENCE = 2.0
_WEIGHT = 0.6

_USUAL = 25
_GONE_PEAK = 0.17
_GONE_SHARE = 0.4
_SURE = 6.0
_LOST = -6.0
_FOUND_PEAK = 0.4
_FOUND_SHARE = 0.5
_SEARCHES = 9
_WIDEN_EVERY = 8
_WIDEST = 4


def peak_evidence(peak: Array) -> Array:
    """How much a response's peak speaks for the target being there: log-odds, any shape.

    Among the signals of the tracker itself the peak's height tells most: a target is hardly ever
    there below 0.2, nearly always above 0.4. It is bounded, since a background that was learnt
    by mistake peaks highly too, and weighted, since neighbouring frames tell much the same.
    Frames without a peak (the keyframe) speak for nothing.
    """
    return _bounded_evidence(peak, _USUAL_PEAK)


def _bounded_evidence(peak: Array, even: float) -> Array:
    evidence = np.clip(_EVIDENCE_PER_PEAK * (peak - even), -_MOST_EVIDENCE, _MOST_EVIDENCE)
    return _WEIGHT * np.nan_to_num(evidence, nan=0.0)


@dataclass(frozen=True, slots=True)
class Pass:
    """What a tracker said from a keyframe on, in the order of tracking.

    Attributes
    ----------
    boxes : ndarray
        (n, 4): x, y, width, height in pixels; row 0 is the keyframe's own box.
    apce, peak : ndarray
        (n,), of the winning responses; NaN in row 0.
    lost : ndarray of bool
        (n,), where the target was given up.
    """

    boxes: Array
    apce: Array
    peak: Array
    lost: npt.NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.boxes)

    def head(self, count: int) -> "Pass":
        """The first rows."""
        return Pass(self.boxes[:count], self.apce[:count], self.peak[:count], self.lost[:count])

    def reversed(self) -> "Pass":
        """The same, last row first: a backward pass in the order of time."""
        return Pass(self.boxes[::-1], self.apce[::-1], self.peak[::-1], self.lost[::-1])


class Follower:
    """Follows a target from a keyframe on, picture by picture.

    Parameters
    ----------
    keyframe : Keyframe
        With a box.
    image : Image
        Its picture.
    make_tracker : TrackerFactory
        Called once.
    search : bool
        Whether to notice that the target is lost, learn nothing more, and search for it: with
        the keyframe's template, around where it was last seen, ever more widely. For stretches
        that no later keyframe closes.
    """

    def __init__(
        self, keyframe: Keyframe, image: Image, make_tracker: TrackerFactory, *, search: bool
    ) -> None:
        assert keyframe.box is not None, "a pass starts from a box"
        self.keyframe = keyframe
        self._tracker = make_tracker()
        self._tracker.init(image, keyframe.box)
        self._searcher: _Searcher | None = None
        if search and isinstance(self._tracker, SitupTracker):
            self._searcher = _Searcher(self._tracker)
        self._rows = [_row(keyframe.box)]
        self._lost_rows: list[range] = []

    def step(self, image: Image, shift_xy: tuple[float, float]) -> None:
        """Find the target in the next picture, into which the scene moved by ``shift_xy``."""
        searcher = self._searcher
        if searcher is not None and searcher.is_lost:
            estimate, tracker = searcher.search(image, shift_xy)
            lost = 1 if tracker is None else 0
            self._tracker = tracker or self._tracker
        else:
            estimate = self._tracker.update(image, shift_xy)
            lost = 0 if searcher is None else searcher.judge(estimate)
        self._rows.append(_row(estimate.fine_box, estimate.apce, estimate.peak))
        self._lost_rows.append(range(len(self._rows) - lost, len(self._rows)))

    def finish(self) -> Pass:
        """Everything so far."""
        rows = np.array(self._rows)
        lost = np.zeros(len(rows), bool)
        for stretch in self._lost_rows:
            lost[stretch.start : stretch.stop] = True
        return Pass(rows[:, :4], rows[:, 4], rows[:, 5], lost)


def _row(
    box: BoundingBox, apce: float = np.nan, peak: float = np.nan
) -> tuple[float, float, float, float, float, float]:
    return box.x, box.y, box.width, box.height, apce, peak


class _Searcher:
    """Notices that a target is lost, and searches for it."""

    def __init__(self, tracker: SitupTracker) -> None:
        self._template = tracker.copy()
        self._odds = _SURE
        self._peaks: deque[float] = deque(maxlen=_USUAL)
        self._doubtful = 0
        self._last_seen: BoundingBox | None = None
        self._frames_lost = 0
        self._offsets: Iterator[tuple[int, int]] = iter(())
        self.is_lost = False

    def judge(self, estimate: Estimate) -> int:
        """Take note of an estimate; say for how many frames, this one included, it is lost.

        It was lost when the odds, summed over the frames, began to fall for good.
        """
        even = max(_GONE_PEAK, _GONE_SHARE * self._usual_peak())
        self._odds = min(
            self._odds + float(_bounded_evidence(np.array(estimate.peak), even)), _SURE
        )
        if self._odds == _SURE or self._last_seen is None:
            self._doubtful, self._last_seen = 0, estimate.fine_box
            self._peaks.append(estimate.peak)
        else:
            self._doubtful += 1
        self.is_lost = self._odds < _LOST
        return self._doubtful if self.is_lost else 0

    def search(
        self, image: Image, shift_xy: tuple[float, float]
    ) -> tuple[Estimate, SitupTracker | None]:
        """Look for the target at a few places more.

        Returns
        -------
        estimate : Estimate
            Where it is if it was found, else where it was seen last, moved along with the scene.
        tracker : SitupTracker or None
            Goes on from there with the keyframe's template; None if it was not found.
        """
        seen = self._last_seen
        assert seen is not None, "a target is lost after it was seen"
        seen = BoundingBox(seen.x + shift_xy[0], seen.y + shift_xy[1], seen.width, seen.height)
        self._last_seen = seen
        self._frames_lost += 1
        best: Estimate | None = None
        for right, down in self._next_offsets():
            self._template.place(
                BoundingBox(
                    seen.x + right * seen.width,
                    seen.y + down * seen.height,
                    seen.width,
                    seen.height,
                )
            )
            estimate = self._template.locate(image)
            if best is None or estimate.peak > best.peak:
                best = estimate
        assert best is not None, "there is always a place to search"
        if best.peak < max(_FOUND_PEAK, _FOUND_SHARE * self._usual_peak()):
            return Estimate(seen, seen, best.apce, best.peak, best.scale), None
        self.is_lost, self._frames_lost = False, 0
        self._odds, self._doubtful, self._last_seen = 0.0, 0, best.fine_box
        tracker = self._template.copy()
        tracker.place(best.box)
        return best, tracker

    def _usual_peak(self) -> float:
        """Median of the last peaks where the target was surely there; 0 before the first."""
        return statistics.median(self._peaks) if self._peaks else 0.0

    def _next_offsets(self) -> list[tuple[int, int]]:
        """Places to search in this frame, in target sizes: nearest first, then over again."""
        offsets: list[tuple[int, int]] = []
        while len(offsets) < _SEARCHES:
            offset = next(self._offsets, None)
            if offset is None:
                reach = min(1 + self._frames_lost // _WIDEN_EVERY, _WIDEST)
                self._offsets = iter(_rings(reach))
            else:
                offsets.append(offset)
        return offsets


def _rings(reach: int) -> list[tuple[int, int]]:
    """All whole offsets up to a reach in both directions, the nearest first."""
    steps = range(-reach, reach + 1)
    return sorted(((x, y) for x in steps for y in steps), key=lambda o: (max(map(abs, o)), o))
