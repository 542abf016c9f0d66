"""Resizing against the definition, written out for one number at a time."""

import numpy as np
import pytest

from situp_annotate.tracking.resizing import halve, plan_resizing, resize


def cubic(x):
    x = abs(x)
    if x <= 1:
        return 1.5 * x**3 - 2.5 * x**2 + 1
    return -0.5 * x**3 + 2.5 * x**2 - 4 * x + 2 if x <= 2 else 0.0


def along(line, count, scale):
    """One line of a picture at another size, MATLAB's way."""
    stretch, size = min(scale, 1), len(line)
    out = []
    for i in range(count):
        center = (i + 0.5) / scale - 0.5
        places = range(int(np.floor(center - 2 / stretch)), int(np.ceil(center + 2 / stretch)) + 1)
        weights = np.array([cubic(stretch * (center - place)) for place in places])
        mirrored = [place % (2 * size) for place in places]
        values = np.array([line[min(place, 2 * size - 1 - place)] for place in mirrored], float)
        out.append(np.clip(np.floor(weights @ values / weights.sum() + 0.5), 0, 255))
    return np.array(out, np.uint8)


def resized(plane, rows, columns, scale_y, scale_x):
    """One channel, the axis that shrinks more first."""
    first, second = (0, rows, scale_y), (1, columns, scale_x)
    for axis, count, scale in [first, second] if scale_y <= scale_x else [second, first]:
        plane = np.apply_along_axis(along, axis, plane, count, scale)
    return plane


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize(
    ("before", "after"),
    [((24, 40), (6, 10)), ((27, 41), (6, 10)), ((43, 29), (10, 7)), ((8, 9), (2, 2))],
)  # fmt: skip
def test_windows_shrink_as_in_matlab(channels, before, after):
    picture = np.random.default_rng(0).integers(0, 256, (before[0], channels, before[1]), np.uint8)
    small = resize(picture, plan_resizing(before, after))
    for channel in range(channels):
        scales = (after[0] / before[0], after[1] / before[1])
        expected = resized(picture[:, channel], *after, *scales)
        np.testing.assert_array_equal(small[:, :, channel].T, expected)


@pytest.mark.parametrize("size", [(20, 30), (21, 33)])
def test_half_size(size):
    picture = np.random.default_rng(1).integers(0, 256, (*size, 3), np.uint8)
    rows, columns = (size[0] + 1) // 2, (size[1] + 1) // 2
    half = np.empty((rows, columns, 3), np.uint8)
    halve(picture, (0, rows, 0, columns), half)
    for channel in range(3):
        expected = resized(picture[..., channel], rows, columns, 0.5, 0.5)
        np.testing.assert_array_equal(half[..., channel], expected)


def test_a_part_at_half_size_is_that_part_of_the_whole():
    picture = np.random.default_rng(2).integers(0, 256, (40, 50, 3), np.uint8)
    whole, part = np.zeros((2, 20, 25, 3), np.uint8)
    halve(picture, (0, 20, 0, 25), whole)
    halve(picture, (3, 9, 5, 21), part)
    np.testing.assert_array_equal(part[3:9, 5:21], whole[3:9, 5:21])
    part[3:9, 5:21] = 0
    assert not part.any()
