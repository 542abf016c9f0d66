"""Animated pictures: how many, when, and in which colours."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image as Pillow
from support.media import draw_index, read_index

from situp_annotate.formats.overlay.animation import encode_animation

SIZE_HW = (96, 128)


def pictures(content):
    file = Pillow.open(BytesIO(content))
    for number in range(file.n_frames):
        file.seek(number)
        yield np.asarray(file.convert("RGB"))[..., ::-1], file.info.get("duration")


@pytest.mark.parametrize("form", ["gif", "webp"])
def test_pictures_come_back(form):
    images = [draw_index(index, SIZE_HW) for index in range(12)]
    content = encode_animation(images, [index * 10**8 for index in range(13)], form)
    back = [image for image, _ in pictures(content)]
    assert [read_index(image) for image in back] == list(range(12))
    assert max(np.abs(a.astype(int) - b).mean() for a, b in zip(back, images, strict=True)) < 8
    assert Pillow.open(BytesIO(content)).info["loop"] == 0


def test_times_of_a_gif_do_not_drift():
    times = [round(index * 1e9 / 30) for index in range(31)]
    images = [draw_index(index, SIZE_HW) for index in range(30)]
    durations = [duration for _, duration in pictures(encode_animation(images, times, "gif"))]
    assert set(durations) == {30, 40}
    assert sum(durations) == 1000


def test_small_things_keep_their_colour_in_a_gif():
    rng = np.random.default_rng(1)
    ground = rng.integers(0, 60, (*SIZE_HW, 3), np.uint8) + np.uint8(90)
    image = ground.copy()
    image[10:14, 20:40] = (250, 72, 86)
    ((back, _),) = pictures(encode_animation([image], [0, 10**8], "gif"))
    assert np.abs(back[11, 30].astype(int) - (250, 72, 86)).max() < 40


def test_one_picture_is_enough():
    assert len(list(pictures(encode_animation([draw_index(3)], [0, 10**9], "webp")))) == 1
