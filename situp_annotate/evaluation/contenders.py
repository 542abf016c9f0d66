"""Ways to get from a person's boxes to a box in every frame, to be compared."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

from situp_annotate.propagation import PropagationOptions, TrackerFactory
from situp_annotate.trackers import PRESETS, default_tracker, make_mil
from situp_annotate.tracking import SitupTracker
from situp_annotate.types import Method

__all__ = ["CONTENDERS", "Contender"]


@dataclass(frozen=True, slots=True)
class Contender:
    """A way to get from a person's boxes to a box in every frame.

    Attributes
    ----------
    options : PropagationOptions
        How boxes are propagated.
    tracker : TrackerFactory
        By which tracker, where one is used.
    most_boxes : int or None
        Boxes after which it is not followed further, for want of time; None without such a limit.
    """

    options: PropagationOptions
    tracker: TrackerFactory = default_tracker
    most_boxes: int | None = None


CONTENDERS: Mapping[str, Contender] = {
    "hold": Contender(PropagationOptions(method=Method.HOLD)),
    "linear": Contender(PropagationOptions(method=Method.LINEAR)),
    "cubic": Contender(PropagationOptions(method=Method.CUBIC)),
    "mil": Contender(PropagationOptions(direction="forward"), make_mil, most_boxes=3),
    "forward": Contender(PropagationOptions(direction="forward")),
    "both": Contender(PropagationOptions()),
    **{
        name: Contender(PropagationOptions(), partial(SitupTracker, PRESETS[name].params))
        for name in ("situp", "accurate")
    },
}
"""By name. ``both`` is what ``run`` does by default, and presets take its tracker's place.

``mil`` is OpenCV's tracker, some fifty times slower: its budgets end at 3 boxes.
"""
