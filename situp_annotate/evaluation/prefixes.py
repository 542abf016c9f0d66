"""Passes of a tracker, from which shorter ones are taken instead of tracking again."""

from collections.abc import Iterator, MutableMapping

from situp_annotate.propagation import Pass, PassKey
from situp_annotate.types import BoundingBox

__all__ = ["PrefixCache"]

_Start = tuple[int, BoundingBox, bool]


class PrefixCache(MutableMapping[PassKey, Pass]):
    """Answers with the beginning of a longer pass from the same box in the same direction.

    A new keyframe cuts a stretch in two, and what was tracked over the whole stretch covers the
    first part already. A pass that may search for a lost target does so only for frames marked
    as lost: up to these it is the same as one that may not.
    """

    def __init__(self) -> None:
        self._passes: dict[PassKey, Pass] = {}
        self._longer: dict[_Start, list[PassKey]] = {}

    def __getitem__(self, key: PassKey) -> Pass:
        found = self._passes.get(key)
        if found is None and key.last is not None:
            count = abs(key.last - key.frame) + 1
            for other in self._longer.get(_start(key), ()):
                whole = self._passes[other]
                allowed = other.open or not key.open
                if allowed and len(whole) >= count and not whole.lost[:count].any():
                    found = whole.head(count)
                    break
        if found is None:
            raise KeyError(key)
        return found

    def __setitem__(self, key: PassKey, value: Pass) -> None:
        if key not in self._passes:
            self._longer.setdefault(_start(key), []).append(key)
        self._passes[key] = value

    def __delitem__(self, key: PassKey) -> None:
        del self._passes[key]
        self._longer[_start(key)].remove(key)

    def __iter__(self) -> Iterator[PassKey]:
        return iter(self._passes)

    def __len__(self) -> int:
        return len(self._passes)


def _start(key: PassKey) -> _Start:
    return key.frame, key.box, key.is_backward
