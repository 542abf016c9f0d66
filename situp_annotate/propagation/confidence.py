"""How far a tracked box can be trusted, from the tracker's own response."""

import statistics
from collections import deque

__all__ = ["RelativeSharpness"]

_USUAL = 25


class RelativeSharpness:
    """Confidence as the APCE of a response relative to what is usual for the track.

    The first responses after a keyframe, where the target is surely in view, say what sharpness
    is usual; a response of that sharpness or more has confidence 1, one of half of it 0.5. It
    ranks the frames of a track; it is not a calibrated probability.
    """

    def __init__(self) -> None:
        self._usual: deque[float] = deque(maxlen=_USUAL)

    def __call__(self, apce: float) -> float:
        """Confidence in [0, 1] for the next response of this APCE (≥ 0)."""
        if len(self._usual) < _USUAL:
            self._usual.append(apce)
        usual = statistics.median(self._usual)
        return min(1.0, apce / usual) if usual > 0 else 0.0
