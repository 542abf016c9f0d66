"""Which stretch of video is tracked from which keyframe, in which direction."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from situp_annotate.types import BoundingBox, Keyframe

__all__ = ["PassKey", "Span", "backward_passes", "forward_passes", "runs", "spans"]


class PassKey(NamedTuple):
    """What a pass depends on, besides the video and the tracker.

    Attributes
    ----------
    frame : int
        Frame of the keyframe that it starts from.
    box : BoundingBox
        The keyframe's box.
    last : int or None
        Frame with which it ends, before or after `frame`; None for the end of the video.
    open : bool
        Whether no keyframe stands at its end, so that a lost target is searched for.
    """

    frame: int
    box: BoundingBox
    last: int | None
    open: bool

    @property
    def is_backward(self) -> bool:
        """Whether it goes from later frames to earlier ones."""
        return self.last is not None and self.last < self.frame


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of frames that depends on nothing but the keyframes at its ends.

    Attributes
    ----------
    start, stop : int
        First frame, and the one after the last; a keyframe with a box stands at one end or both.
    before, after : Keyframe or None
        The keyframes that close it, at frames ``start`` and ``stop - 1``.
    """

    start: int
    stop: int
    before: Keyframe | None
    after: Keyframe | None

    @property
    def is_hidden(self) -> bool:
        """Whether the person says that the object is hidden from one box to the other."""
        return self.before is not None and self.after is not None and self.before.occluded


def _pairs(keyframes: Sequence[Keyframe]) -> Iterator[tuple[Keyframe, Keyframe | None]]:
    """Each keyframe with the next one."""
    return zip(keyframes, [*keyframes, None][1:], strict=True)


def forward_passes(keyframes: Sequence[Keyframe]) -> list[PassKey]:
    """The passes to make forward: one for each keyframe with a box, unless hidden until the next.

    A pass goes up to and into the next keyframe, to see how well it meets the box there.
    """
    passes = []
    for keyframe, after in _pairs(keyframes):
        if keyframe.box is None:
            continue
        closed = after is not None and after.box is not None
        if closed and keyframe.occluded:
            continue
        last = after.frame - (0 if closed else 1) if after is not None else None
        passes.append(PassKey(keyframe.frame, keyframe.box, last, not closed))
    return passes


def backward_passes(keyframes: Sequence[Keyframe], *, extend: bool) -> list[PassKey]:
    """The passes to make backward: between boxes, and to the video's start if asked for."""
    passes = [
        PassKey(after.frame, after.box, before.frame, False)
        for before, after in _pairs(keyframes)
        if before.box is not None and not before.occluded
        if after is not None and after.box is not None
    ]
    first = keyframes[0] if keyframes else None
    if extend and first is not None and first.box is not None and first.frame > 0:
        passes.append(PassKey(first.frame, first.box, 0, True))
    return passes


def spans(keyframes: Sequence[Keyframe], frame_count: int, *, extend: bool) -> list[Span]:
    """The stretches that have boxes, in order; neighbours share the keyframe between them."""
    found = []
    first = keyframes[0] if keyframes else None
    if extend and first is not None and first.box is not None and first.frame > 0:
        found.append(Span(0, first.frame + 1, None, first))
    for keyframe, after in _pairs(keyframes):
        if keyframe.box is None:
            continue
        if after is not None and after.box is not None:
            found.append(Span(keyframe.frame, after.frame + 1, keyframe, after))
        else:
            stop = frame_count if after is None else after.frame
            found.append(Span(keyframe.frame, stop, keyframe, None))
    return found


def runs(keyframes: Sequence[Keyframe]) -> list[list[Keyframe]]:
    """Keyframes with boxes, parted where the object is outside."""
    parted: list[list[Keyframe]] = [[]]
    for keyframe in keyframes:
        if keyframe.box is None:
            parted.append([])
        else:
            parted[-1].append(keyframe)
    return [run for run in parted if run]
