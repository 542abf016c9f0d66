"""From passes to labels: boxes, states, provenance and confidence of a span."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.ndimage import median_filter

from situp_annotate.propagation.confidence import Evidence, Kind, probability
from situp_annotate.propagation.fusion import bridge, fuse, overlaps
from situp_annotate.propagation.labels import Stretch
from situp_annotate.propagation.passes import Pass
from situp_annotate.propagation.spans import Span
from situp_annotate.propagation.trust import Trust
from situp_annotate.types import BoundingBox, Provenance, State

__all__ = ["label_bridged", "label_closed", "label_interpolated", "label_open"]

Array = npt.NDArray[np.float64]
Codes = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

_SMOOTH = 5
_KINDS = list(Kind)
_KIND_OF_TRUST = np.array(
    [_KINDS.index(k) for k in (Kind.AGREED, Kind.ONE_PASS, Kind.ONE_PASS, Kind.BRIDGED)]
)
_NOT_TRACKED = (Kind.BRIDGED, Kind.LOST, Kind.INTERPOLATED)


class _Signals(NamedTuple):
    """What responses say, (n,) each; NaN where there is none."""

    apce: Array
    peak: Array
    weakest: Array


def label_closed(span: Span, forward: Pass, backward: Pass | None, shifts: Array) -> Stretch:
    """Label a span between two human boxes.

    Parameters
    ----------
    span : Span
        Of n frames, with a keyframe at either end.
    forward : Pass
        From the keyframe before, n rows.
    backward : Pass or None
        From the keyframe after, n rows in the order of time; None to go by the forward pass alone.
    shifts : ndarray
        (n, 2), the scene's motion; see :func:`fuse`.
    """
    if backward is None:
        boxes = forward.boxes.copy()
        boxes[-1] = _row(span.after.box if span.after else None)
        met = np.full(len(boxes), overlaps(forward.boxes[-1:], boxes[-1:])[0])
        return _stretch(span, boxes, _codes(Kind.ONE_PASS, len(boxes)), _signals(forward), met=met)
    fused = fuse(forward, backward, shifts)
    ahead = np.isin(fused.trust, (Trust.BOTH, Trust.FORWARD))
    behind = np.isin(fused.trust, (Trust.BOTH, Trust.BACKWARD))
    signals = _Signals(
        *(
            _mean(one, other, ahead, behind)
            for one, other in zip(_signals(forward), _signals(backward), strict=True)
        )
    )
    met = _mean(
        np.full(len(ahead), fused.agreement[-1]),
        np.full(len(ahead), fused.agreement[0]),
        ahead,
        behind,
    )
    kinds = _KIND_OF_TRUST[fused.trust]
    return _stretch(span, fused.boxes, kinds, signals, agreement=fused.agreement, met=met)


def label_bridged(span: Span, shifts: Array) -> Stretch:
    """Label a span in which the object is hidden: its boxes go straight, in the moving scene.

    Parameters
    ----------
    span : Span
        Of n frames, with a keyframe at either end.
    shifts : ndarray
        (n, 2), the scene's motion; see :func:`fuse`.
    """
    first, last = (np.array(_row(end.box if end else None)) for end in (span.before, span.after))
    boxes = bridge(first, last, shifts)
    nothing = np.full(len(boxes), np.nan)
    return _stretch(span, boxes, _codes(Kind.BRIDGED, len(boxes)), _Signals(*[nothing] * 3))


def label_open(span: Span, one: Pass) -> Stretch:
    """Label a span with a human box at one end only, from its pass in the order of time."""
    kinds = np.where(one.lost, _KINDS.index(Kind.LOST), _KINDS.index(Kind.OPEN))
    return _stretch(span, one.boxes, kinds, _signals(one))


def label_interpolated(span: Span, boxes: Array) -> Stretch:
    """Label a span whose boxes, (n, 4), were interpolated or held."""
    nothing = np.full(len(boxes), np.nan)
    kinds = _codes(Kind.INTERPOLATED, len(boxes))
    return _stretch(span, boxes, kinds, _Signals(*[nothing] * 3))


def _row(box: BoundingBox | None) -> tuple[float, float, float, float]:
    assert box is not None, "keyframes at the ends of spans have boxes"
    return box.x, box.y, box.width, box.height


def _codes(kind: Kind, count: int) -> Codes:
    return np.full(count, _KINDS.index(kind))


def _signals(one: Pass) -> _Signals:
    """Signals of a pass in the order of time."""
    came_backward = bool(np.isnan(one.peak[-1]) and not np.isnan(one.peak[0]))
    tracked = one.peak[::-1] if came_backward else one.peak
    weakest = np.full(len(tracked), np.nan)
    weakest[1:] = (
        np.minimum.accumulate(median_filter(tracked[1:], _SMOOTH)) if len(tracked) > 1 else 0
    )
    return _Signals(one.apce, one.peak, weakest[::-1] if came_backward else weakest)


def _mean(one: Array, other: Array, use_one: Flags, use_other: Flags) -> Array:
    """Mean of the values that are used and are there; NaN without any."""
    values = np.stack([one, other])
    used = np.stack([use_one, use_other]) & ~np.isnan(values)
    total = np.where(used, values, 0.0).sum(axis=0)
    count = used.sum(axis=0)
    mean: Array = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return mean


def _log_size(box: Array) -> Array:
    """log(√area) of boxes (..., 4)."""
    size: Array = np.log(box[..., 2] * box[..., 3]) / 2
    return size


def _stretch(
    span: Span,
    boxes: Array,
    kinds: Codes,
    signals: _Signals,
    *,
    agreement: Array | None = None,
    met: Array | None = None,
) -> Stretch:
    """Put together what is known of a span's boxes."""
    count = len(boxes)
    first, last = (0 if span.before else None), (count - 1 if span.after else None)
    ends = [row for row in (first, last) if row is not None]
    rows = np.arange(count)
    distance = np.abs(rows[:, np.newaxis] - ends).min(axis=1)
    straight = np.interp(rows, ends, _log_size(boxes[ends]))
    nothing = np.zeros(count)
    evidence = Evidence(
        kind=kinds,
        peak=np.nan_to_num(signals.peak),
        weakest=np.nan_to_num(signals.weakest),
        agreement=nothing if agreement is None else agreement,
        met=nothing if met is None else np.nan_to_num(met),
        distance=np.log1p(distance),
        drift=np.abs(_log_size(boxes) - straight),
    )
    confidence = probability(evidence)
    confidence[ends] = 1.0
    states, provenances = _words(span, kinds, ends)
    return Stretch(
        start=span.start,
        boxes=boxes,
        states=states,
        provenances=provenances,
        confidence=confidence,
        evidence=evidence,
        apce=signals.apce,
        peak=signals.peak,
        scale=np.exp(_log_size(boxes) - _log_size(boxes[ends[0]])),
    )


def _words(
    span: Span, kinds: Codes, ends: list[int]
) -> tuple[tuple[State, ...], tuple[Provenance, ...]]:
    """States and provenances of a span's frames."""
    usual = State.OCCLUDED if span.before and span.before.occluded else State.VISIBLE
    of_kind = dict.fromkeys(Kind, usual) | {
        Kind.BRIDGED: State.OCCLUDED,
        Kind.LOST: State.LOST,
    }
    states = [of_kind[_KINDS[code]] for code in kinds]
    provenances = [
        Provenance.INTERPOLATED if _KINDS[code] in _NOT_TRACKED else Provenance.TRACKED
        for code in kinds
    ]
    for row in ends:
        keyframe = span.before if row == 0 and span.before else span.after
        assert keyframe is not None, "a keyframe stands at each end"
        states[row] = State.OCCLUDED if keyframe.occluded else State.VISIBLE
        provenances[row] = Provenance.HUMAN
    return tuple(states), tuple(provenances)
