"""Time one tracker's updates on one sequence; speed.py starts this once per measurement.

Prints a JSON object: seconds of each update, and the boxes (x, y, width, height, counted from 0)
of all frames. Needs OpenCV and NumPy only, unless the tracker is one of ours, so that it also runs
in the virtual environment of the peers.
"""

import argparse
import json
import os
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np

Box = tuple[float, float, float, float]
Image = np.ndarray
Update = Callable[[Image], Box]

contributed: Any = cv2  # types are known only of the trackers in every build

_PICTURES = {".jpg", ".jpeg", ".png", ".bmp"}


def opencv(tracker: Any, first: Image, box: Box) -> Update:  # noqa: ANN401 - no common type
    """Start one of OpenCV's trackers; where it reports nothing, its box stays where it was."""
    tracker.init(first, tuple(round(number) for number in box))
    last = box

    def update(image: Image) -> Box:
        nonlocal last
        found, now = tracker.update(image)
        if found:
            x, y, width, height = (float(number) for number in now)
            last = (x, y, width, height)
        return last

    return update


def kcf(first: Image, box: Box) -> Update:
    """KCF that never gives up: by default it does on most sequences, and then runs idle."""
    params = contributed.TrackerKCF_Params()
    params.detect_thresh = 0.0
    return opencv(contributed.TrackerKCF_create(params), first, box)


def csrt(first: Image, box: Box) -> Update:
    """CSRT as it comes."""
    return opencv(contributed.TrackerCSRT_create(), first, box)


def ours(name: str, first: Image, box: Box) -> Update:
    """One of our presets."""
    from situp_annotate import BoundingBox
    from situp_annotate.trackers import make_tracker

    tracker = make_tracker(name)
    tracker.init(first, BoundingBox(*box))

    def update(image: Image) -> Box:
        found = tracker.update(image).box
        return found.x, found.y, found.width, found.height

    return update


PEERS = {"opencv-kcf": kcf, "opencv-csrt": csrt}


def frames_of(folder: Path, limit: int | None) -> list[Image]:
    """Decode the pictures of a sequence: (h, w, 3), or (h, w) where the file is grey."""
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in _PICTURES)
    frames = [cv2.imread(str(path), cv2.IMREAD_UNCHANGED) for path in paths[:limit]]
    return [frame for frame in frames if frame is not None]


def main() -> None:
    """Load, track, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tracker", required=True, help=f"{', '.join(PEERS)}, or one of ours")
    parser.add_argument("--pictures", type=Path, required=True)
    parser.add_argument("--box", type=float, nargs=4, required=True)
    parser.add_argument("--frames", type=int)
    parser.add_argument("--core", type=int, help="pin to this CPU core")
    arguments = parser.parse_args()
    if arguments.core is not None:
        os.sched_setaffinity(0, {arguments.core})
    cv2.setNumThreads(1)
    frames = frames_of(arguments.pictures, arguments.frames)
    start_tracking = PEERS.get(arguments.tracker, partial(ours, arguments.tracker))
    if arguments.tracker in PEERS:  # OpenCV's trackers want three channels
        frames = [
            cv2.cvtColor(frame, cv2.COLOR_GRAY2BGR) if frame.ndim == 2 else frame
            for frame in frames
        ]
    update = start_tracking(frames[0], tuple(arguments.box))
    if arguments.tracker not in PEERS:  # the kernels are compiled and loaded now
        update(frames[0])
        update = start_tracking(frames[0], tuple(arguments.box))
    seconds, boxes = [], [tuple(arguments.box)]
    for frame in frames[1:]:
        start = time.perf_counter()
        boxes.append(update(frame))
        seconds.append(time.perf_counter() - start)
    if not np.isfinite(boxes).all():
        raise SystemExit("The tracker gave boxes that are not finite.")
    print(json.dumps({"seconds": seconds, "boxes": boxes}))


if __name__ == "__main__":
    main()
