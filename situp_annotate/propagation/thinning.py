"""Thinning: the fewest keyframes whose linear interpolation stays close to a dense track.

The frames of a track are nodes, and there is an edge from one to a later one if interpolating
between their boxes overlaps the box of every frame between them enough. The fewest keyframes
are a shortest path, which a breadth-first search finds.

Notes
-----
An object that stands still for ten minutes has 10⁸ edges, and testing one takes a step for each
of its frames. Three things keep the search quick; none changes its result:

* The boxes that overlap a box enough lie within limits that are linear in position and size (see
  :func:`_tighten`). Seen from a start, the limits of each later frame bound the pace at which
  position and size may change: the cone in which the ends of edges lie narrows from frame to
  frame, and no edge goes further than where it closes.
* Ends are tried from the furthest to the nearest, and the search is over once the last is found.
* What spoilt the last edge from the same start, or to the same end, is likely to spoil the next:
  that frame is tested before all others.
"""

from collections.abc import Collection, Mapping
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from numba import njit

from situp_annotate.types import BoundingBox

__all__ = ["overlaps", "thin"]

_Real = npt.NDArray[np.float64]

# Of what fast arithmetic may do, only what leaves every finite result as it is: a frame must
# come out the same whether it is tested alone or in a block.
_kernel = njit(cache=True, nogil=True, error_model="numpy", fastmath={"nnan", "nsz"})

_BLOCK = 64
"""Frames taken at a time, so that loops over them become vector code."""

_AS_FLOATS_ADD_UP = 1e-12
"""Relative: a box that is interpolated to the digit overlaps itself by a little less than 1."""

_SLACK = 1e-6
"""Relative: cones are wider by this, far above what floats add up to, so as to lose no edge."""


@_kernel
def _spoils(boxes, start, end, frame, iou, rounding):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Whether the interpolation from start to end overlaps the box of a frame too little."""
    xs, ys, widths, heights = boxes[0], boxes[1], boxes[2], boxes[3]
    share = (frame - start) / (end - start)
    x = xs[start] + (xs[end] - xs[start]) * share
    y = ys[start] + (ys[end] - ys[start]) * share
    width = widths[start] + (widths[end] - widths[start]) * share
    height = heights[start] + (heights[end] - heights[start]) * share
    right = min(x + width, xs[frame] + widths[frame])
    bottom = min(y + height, ys[frame] + heights[frame])
    # Rounding x and width can move the right edge by twice as much.
    across = max(right - max(x, xs[frame]) - 2 * rounding, 0.0)
    down = max(bottom - max(y, ys[frame]) - 2 * rounding, 0.0)
    shared = across * down
    areas = (width + rounding) * (height + rounding) + widths[frame] * heights[frame]
    return shared < iou * (areas - shared)


@_kernel
def _tighten(positions, sizes, position, size, paces, iou, cone):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Narrow the cone along one axis by some frames; tell whether nothing is left of it.

    Boxes overlap no more than their extents along an axis do. For extents [p, p + s) and
    [q, q + r), with t for the bound, an overlap of t or more is the same as all of

        t·r ≤ s ≤ r/t,   (1 + t)·p + s ≥ (1 + t)·q + t·r,   (1 + t)·p + t·s ≤ (1 + t)·q + r,

    which are linear in p and s. The cone holds, for each of the four, how much its left side may
    change a frame: at least, at most, at least, at most.
    """
    lean, wide, low, high = cone[0], cone[1], cone[2], cone[3]
    for i in range(len(positions)):
        moved = (1 + iou) * (positions[i] - position)
        lean = max(lean, (iou * sizes[i] - size) * paces[i])
        wide = min(wide, (sizes[i] / iou - size) * paces[i])
        low = max(low, (moved + iou * sizes[i] - size) * paces[i])
        high = min(high, (moved + sizes[i] - iou * size) * paces[i])
    cone[0], cone[1], cone[2], cone[3] = lean, wide, low, high
    return lean > wide or low - high > (1 - iou) * wide


@_kernel
def _is_within(positions, sizes, start, end, pace, iou, cone):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Whether a frame lies in the cone of an axis."""
    moved = (1 + iou) * (positions[end] - positions[start]) * pace
    growth = (sizes[end] - sizes[start]) * pace
    return (
        cone[0] <= growth <= cone[1]
        and moved + growth >= cone[2]
        and moved + iou * growth <= cone[3]
    )


@_kernel
def _list_ends(boxes, start, origins, inverse, iou, ends):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """List the frames not yet reached to which an edge from the start may go; return how many."""
    count = len(origins)
    xs, ys, widths, heights = boxes[0], boxes[1], boxes[2], boxes[3]
    cones = np.empty((2, 4))
    cones[:, 0::2] = -np.inf
    cones[:, 1::2] = np.inf
    found = 0
    for first in range(start + 1, count, _BLOCK):
        last = min(first + _BLOCK, count)
        # The cone from before the block is a little wide, but it does for the whole block.
        for end in range(first, last):
            if origins[end] < 0:
                pace = inverse[end - start]
                if _is_within(xs, widths, start, end, pace, iou, cones[0]) and _is_within(
                    ys, heights, start, end, pace, iou, cones[1]
                ):
                    ends[found] = end
                    found += 1
        paces = inverse[first - start : last - start]
        closed = _tighten(
            xs[first:last], widths[first:last], xs[start], widths[start], paces, iou, cones[0]
        )
        closed |= _tighten(
            ys[first:last], heights[first:last], ys[start], heights[start], paces, iou, cones[1]
        )
        if closed:
            break
    return found


@_kernel
def _is_edge(boxes, start, end, likely, iou, rounding):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Test an edge; ``likely`` holds the frames that spoilt the last ones and is updated."""
    for side in (start, end):
        frame = likely[side]
        if start < frame < end and _spoils(boxes, start, end, frame, iou, rounding):
            return False
    for first in range(start + 1, end, _BLOCK):
        spoiler = end
        for frame in range(first, min(first + _BLOCK, end)):
            spoils = _spoils(boxes, start, end, frame, iou, rounding)
            spoiler = min(spoiler, frame if spoils else end)
        if spoiler < end:
            likely[start] = likely[end] = spoiler
            return False
    return True


@_kernel
def _search(boxes, inverse, iou, cone_iou, rounding):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Breadth-first search from the first frame to the last; the origin of each frame reached."""
    count = len(inverse)
    origins = np.full(count, -1)
    likely = np.zeros(count, np.int64)
    ends = np.empty(count, np.int64)
    queue = np.zeros(count, np.int64)
    done, queued = 0, 1
    origins[0] = 0
    while origins[count - 1] < 0:
        start = queue[done]
        done += 1
        found = _list_ends(boxes, start, origins, inverse, cone_iou, ends)
        for place in range(found - 1, -1, -1):
            end = ends[place]
            if _is_edge(boxes, start, end, likely, iou, rounding):
                origins[end] = start
                queue[queued] = end
                queued += 1
                if end == count - 1:
                    break
    return origins


def _shortest_path(boxes: _Real, iou: float, rounding: float) -> list[int]:
    """Rows (4, frames) of x, y, width, height to the places of the fewest keyframes."""
    last = boxes.shape[1] - 1
    if last < 2:
        return list(range(last + 1))
    inverse = 1 / np.maximum(np.arange(last + 1.0), 1)
    enough = iou * (1 - _AS_FLOATS_ADD_UP)
    origins = _search(boxes, inverse, enough, iou * (1 - _SLACK), rounding)
    path = [last]
    while path[-1] > 0:
        path.append(int(origins[path[-1]]))
    return path[::-1]


def _rows(track: Mapping[int, BoundingBox], frames: Collection[int]) -> _Real:
    """x, y, width and height, a row each: (4, frames)."""
    boxes = [track[frame] for frame in frames]
    return np.array([[b.x, b.y, b.width, b.height] for b in boxes]).T.copy()


def thin(
    track: Mapping[int, BoundingBox],
    *,
    iou: float = 0.9,
    keep: Collection[int] = (),
    rounding: float = 0.0,
) -> dict[int, BoundingBox]:
    """Choose the fewest keyframes between which a track can be interpolated.

    Parameters
    ----------
    track : mapping of int to BoundingBox
        The box of each frame, in any order; where frames are missing, the object is outside.
    iou : float
        In (0, 1]: what the interpolation of x, y, width and height overlaps the box of every
        frame by, at least, as intersection over union.
    keep : collection of int
        Frames that stay keyframes whatever comes.
    rounding : float
        In pixels: how far each interpolated number may be off, once it is written, without an
        overlap becoming less than ``iou``.

    Returns
    -------
    dict of int to BoundingBox
        The keyframes, in order of frames, with the track's own boxes: those of ``keep``, the
        first and the last of each run of frames without a gap, and between them as few as can be.

    Raises
    ------
    ValueError
        If ``iou`` is not in (0, 1], ``rounding`` is negative, or a frame to keep has no box.

    Notes
    -----
    Exact, not greedy: going as far as possible from each keyframe can end at a box that is a
    little off, from which the next edge is short. Of several sets of as few keyframes, it is
    always the same that is chosen.
    """
    if not 0 < iou <= 1:
        raise ValueError(f"iou must be greater than 0 and at most 1, not {iou}.")
    if not rounding >= 0:
        raise ValueError(f"rounding must be 0 or more, not {rounding}.")
    if missing := set(keep).difference(track):
        raise ValueError(f"Frame {min(missing)} is to be kept but has no box.")
    frames = sorted(track)
    boxes = _rows(track, frames)
    place_of = {frame: place for place, frame in enumerate(frames)}
    ends = {frame for frame in frames if frame - 1 not in track or frame + 1 not in track}
    kept = sorted(ends.union(keep))
    chosen = set(kept)
    for first, last in pairwise(kept):
        if first + 1 in track:  # else the gap between two runs
            start = place_of[first]
            stretch = boxes[:, start : place_of[last] + 1].copy()
            path = _shortest_path(stretch, float(iou), float(rounding))
            chosen.update(first + step for step in path)
    return {frame: track[frame] for frame in frames if frame in chosen}


def overlaps(track: Mapping[int, BoundingBox], keyframes: Mapping[int, BoundingBox]) -> _Real:
    """Intersection over union of each box of a track with what keyframes give in its place.

    Parameters
    ----------
    track : mapping of int to BoundingBox
        The box of each frame; at least one.
    keyframes : mapping of int to BoundingBox
        As :func:`thin` returns them.

    Returns
    -------
    ndarray
        (frames,), in order of frames, in [0, 1].
    """
    frames, known = sorted(track), sorted(keyframes)
    boxes = _rows(track, frames)
    given = np.array([np.interp(frames, known, row) for row in _rows(keyframes, known)])
    corner = np.maximum(boxes[:2], given[:2])
    opposite = np.minimum(boxes[:2] + boxes[2:], given[:2] + given[2:])
    shared = np.prod(np.clip(opposite - corner, 0, None), axis=0)
    together = np.prod(boxes[2:], axis=0) + np.prod(given[2:], axis=0) - shared
    return np.asarray(shared / together, dtype=np.float64)
