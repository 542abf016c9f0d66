"""Targets whose every box is known, for the simulated annotator."""

import cv2
import numpy as np

from situp_annotate.evaluation import OtbTarget
from situp_annotate.evaluation.effort import prepare
from situp_annotate.types import Frame

SIZE_HW = (96, 160)


def corner_truth():
    """A wide box that goes right by 4 a frame to frame 10, then back by 2 to frame 29."""
    x = np.interp(np.arange(30), [0, 10, 29], [0, 40, 2])
    return np.stack([x, np.full(30, 30.0), np.full(30, 100.0), np.full(30, 30.0)], axis=1)


def curved_truth():
    """A square that goes on a curve and grows."""
    frames = np.arange(30)
    side = 24 + frames / 6
    return np.stack(
        [20 + 2.5 * frames, 35 + 18 * np.sin(frames / 5), np.round(side), np.round(side)], axis=1
    )


def pictures(truth):
    """A textured square on a textured ground, uint8 (96, 160, 3) each."""
    rng = np.random.default_rng(5)
    ground = cv2.GaussianBlur(rng.integers(0, 256, (*SIZE_HW, 3), dtype=np.uint8), (5, 5), 0)
    texture = rng.integers(0, 256, (12, 12, 3), dtype=np.uint8)
    for x, y, width, height in np.nan_to_num(truth, nan=1).round().astype(int):
        image = ground.copy()
        patch = cv2.resize(texture, (width, height), interpolation=cv2.INTER_LINEAR)
        part = image[y : y + height, x : x + width]
        part[:] = patch[: part.shape[0], : part.shape[1]]
        yield image


def otb_target(truth, name="target"):
    """As a file has it: counted from 1."""
    return OtbTarget(name, truth + (1, 1, 0, 0))


def subject_of(truth, images=None):
    """Ready to be simulated; pictures are black unless given."""
    images = [np.zeros(SIZE_HW, np.uint8)] * len(truth) if images is None else images
    frames = (Frame(index, index, image) for index, image in enumerate(images))
    return prepare(otb_target(truth), frames)


def write_sequence(folder, truth):
    """Write a sequence in OTB layout."""
    (folder / "img").mkdir(parents=True)
    for number, image in enumerate(pictures(truth), start=1):
        cv2.imwrite(str(folder / "img" / f"{number:04}.png"), image)
    lines = [",".join(map(str, row)) for row in truth + (1, 1, 0, 0)]
    (folder / "groundtruth_rect.txt").write_text("\n".join(lines) + "\n")
