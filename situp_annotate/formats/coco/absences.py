"""Which images of COCO say that an object is not in them.

An image says it of a class if something else in it has a box, or if it lists the class as
``neg_category_ids`` (LVIS); not if it lists the class as ``not_exhaustive_category_ids``.
"""

from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence

from situp_annotate.formats.coco.schema import Image

__all__ = ["Absences"]


def _places_after(frames: Sequence[int], hidden: Sequence[int]) -> dict[int, int]:
    """By the place of each frame that is hidden, the place of the next that is not."""
    places: dict[int, int] = {}
    for frame in reversed(hidden):
        place = bisect_left(frames, frame)
        if place < len(frames) and frames[place] == frame:
            places[place] = places.get(place + 1, place + 1)
    return places


class Absences:
    """Finds frames of a video in which an object without a box is outside.

    The time it takes grows with the size of the file, however many classes there are.

    Parameters
    ----------
    images : mapping of int to Image
        By frame.
    labelled : collection of int
        Ids of the images in which there is a box.
    """

    def __init__(self, images: Mapping[int, Image], labelled: Collection[int | None]) -> None:
        ordered = sorted(images.items())
        self._labelled = [frame for frame, image in ordered if image.id in labelled]
        self._hidden: defaultdict[int | None, list[int]] = defaultdict(list)
        self._negative: defaultdict[int | None, list[int]] = defaultdict(list)
        self._skips: dict[int | None, dict[int, int]] = {}
        for frame, image in ordered:
            for category in set(image.not_exhaustive_category_ids):
                self._hidden[category].append(frame)
            for category in {*image.neg_category_ids} - {*image.not_exhaustive_category_ids}:
                self._negative[category].append(frame)

    def after(self, frame: int, category: int | None) -> int | None:
        """The first frame after this one in which every object of the class has its box."""
        if category not in self._skips:
            self._skips[category] = _places_after(self._labelled, self._hidden[category])
        place = bisect_right(self._labelled, frame)
        place = self._skips[category].get(place, place)
        negative = self._negative[category]
        other = bisect_right(negative, frame)
        found = self._labelled[place : place + 1] + negative[other : other + 1]
        return min(found, default=None)
