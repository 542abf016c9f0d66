"""Boxes between keyframes without looking at the picture."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from situp_annotate.types import Keyframe, Method

__all__ = ["interpolate"]

Array = npt.NDArray[np.float64]


def interpolate(keyframes: Sequence[Keyframe], method: Method, start: int, stop: int) -> Array:
    """Boxes of a run of keyframes, in the frames from `start` to before `stop`.

    Beyond the outermost keyframes their boxes are held.

    Parameters
    ----------
    keyframes : sequence of Keyframe
        At least one, in order, all with a box.
    method : Method
        ``HOLD`` repeats each box until the next; ``LINEAR`` interpolates x, y, width and height
        on their own; ``CUBIC`` does so by Fritsch and Carlson's monotone cubics, which never
        overshoot. With ``CUBIC`` a keyframe changes the boxes up to the second-next keyframe on
        either side, with the others up to the next.

    Returns
    -------
    ndarray
        (stop - start, 4): x, y, width, height.
    """
    frames = np.array([keyframe.frame for keyframe in keyframes])
    boxes = np.array(
        [(k.box.x, k.box.y, k.box.width, k.box.height) for k in keyframes if k.box is not None]
    )
    wanted = np.clip(np.arange(start, stop), frames[0], frames[-1])
    if method is Method.HOLD:
        held: Array = boxes[np.searchsorted(frames, wanted, side="right") - 1]
        return held
    if method is Method.CUBIC and len(frames) > 1:
        with np.errstate(over="ignore"):  # of boxes that are next to nothing apart
            smooth: Array = PchipInterpolator(frames, boxes)(wanted)
        return smooth
    return np.stack([np.interp(wanted, frames, column) for column in boxes.T], axis=1)
