"""OpenCV's trackers behind the interface of ours, to compare with."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import cv2

from situp_annotate.errors import TrackingError
from situp_annotate.tracking import Estimate
from situp_annotate.types import BoundingBox, Image

__all__ = ["MODEL_FILES", "OpenCvTracker", "make_mil", "make_with_models"]

_SEED = 1


class OpenCvTracker:
    """One of OpenCV's trackers; where it reports nothing, its box stays where it was.

    It knows nothing of APCE and of peaks, which are 0.

    Parameters
    ----------
    make : callable
        Makes a fresh ``cv2.Tracker``.
    finds_size : bool
        Whether the size of its boxes means something; else that of the first box is kept.

    Notes
    -----
    TrackerMIL draws from two sources of random numbers. OpenCV's own is seeded here for each
    target and picture; the other cannot be reached and goes on from tracker to tracker. What
    repeats is therefore the work of a whole process, not that of a second tracker in it.
    """

    def __init__(self, make: Callable[[], cv2.Tracker], *, finds_size: bool) -> None:
        self._make = make
        self._finds_size = finds_size
        self._tracker: cv2.Tracker | None = None
        self._first = self._box = BoundingBox(0, 0, 1, 1)
        self._pictures = 0

    def init(self, image: Image, box: BoundingBox) -> None:
        """Learn the target from its box in a first picture; forget any target before.

        Raises
        ------
        TrackingError
            If OpenCV cannot make the tracker, say of files that are no models.
        """
        cv2.setRNGSeed(_SEED)
        height, width = image.shape[:2]
        self._first = self._box = box
        self._pictures = 0
        try:
            self._tracker = self._make()
            self._tracker.init(image, _whole_pixels(box, width, height))
        except cv2.error as error:
            raise TrackingError(f"OpenCV cannot make this tracker: {error}") from error

    def update(
        self,
        image: Image,
        shift_xy: tuple[float, float] = (0.0, 0.0),  # noqa: ARG002 - it has no use for it
    ) -> Estimate:
        """Find the target in the next picture.

        Raises
        ------
        TrackingError
            If there was no :meth:`init`.
        """
        if self._tracker is None:
            raise TrackingError("The tracker has no target yet: call init(image, box) first.")
        self._pictures += 1
        cv2.setRNGSeed(_SEED + self._pictures)
        found, (x, y, width, height) = self._tracker.update(image)
        if found and width > 0 and height > 0:
            size = (width, height) if self._finds_size else (self._first.width, self._first.height)
            self._box = BoundingBox(float(x), float(y), float(size[0]), float(size[1]))
        scale = self._box.height / self._first.height
        return Estimate(self._box, self._box, apce=0.0, peak=0.0, scale=scale)


def _whole_pixels(box: BoundingBox, width: int, height: int) -> tuple[int, int, int, int]:
    """The part of a box inside the picture, of two pixels at least."""
    left, top = min(max(round(box.x), 0), width - 2), min(max(round(box.y), 0), height - 2)
    right = min(max(round(box.right), left + 2), width)
    bottom = min(max(round(box.bottom), top + 2), height)
    return left, top, right - left, bottom - top


def make_mil() -> OpenCvTracker:
    """TrackerMIL with its defaults, the one that CVAT offers; it follows the position only.

    References
    ----------
    B. Babenko, M.-H. Yang, S. Belongie, Visual tracking with online multiple instance learning,
    CVPR 2009.
    """
    return OpenCvTracker(cv2.TrackerMIL.create, finds_size=False)


def _vit(net: str) -> cv2.Tracker:
    params = cv2.TrackerVit.Params()
    params.net = net
    return cv2.TrackerVit.create(params)


def _nano(backbone: str, neckhead: str) -> cv2.Tracker:
    params = cv2.TrackerNano.Params()
    params.backbone, params.neckhead = backbone, neckhead
    return cv2.TrackerNano.create(params)


def _dasiamrpn(model: str, kernel_cls1: str, kernel_r1: str) -> cv2.Tracker:
    params = cv2.TrackerDaSiamRPN.Params()
    params.model, params.kernel_cls1, params.kernel_r1 = model, kernel_cls1, kernel_r1
    return cv2.TrackerDaSiamRPN.create(params)


_WITH_MODELS: Mapping[str, Callable[..., cv2.Tracker]] = {
    "vit": _vit,
    "nano": _nano,
    "dasiamrpn": _dasiamrpn,
}

MODEL_FILES: Mapping[str, tuple[str, ...]] = {
    "vit": ("MODEL",),
    "nano": ("BACKBONE", "NECKHEAD"),
    "dasiamrpn": ("MODEL", "KERNEL_CLS1", "KERNEL_R1"),
}
"""Files that each needs, which the user has to have: OpenCV comes without them."""


def make_with_models(name: str, files: Sequence[Path]) -> OpenCvTracker:
    """One of the trackers that are neural networks.

    Parameters
    ----------
    name : str
        A key of `MODEL_FILES`.
    files : sequence of Path
        The files that are named there, in this order.

    Raises
    ------
    TrackingError
        If there are not as many, or one is not there.
    """
    wanted = MODEL_FILES[name]
    if len(files) != len(wanted):
        raise TrackingError(
            f"{name} needs {len(wanted)} model file(s): give {name}:{','.join(wanted)}."
        )
    for file in files:
        if not file.is_file():
            raise TrackingError(f"{file}: this model file for {name} is not there.")
    return OpenCvTracker(lambda: _WITH_MODELS[name](*map(str, files)), finds_size=True)
