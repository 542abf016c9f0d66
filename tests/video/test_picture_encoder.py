"""H.264 for viewers: each picture at once, decodable from every keyframe."""

from fractions import Fraction

import numpy as np
import pytest
from support.media import draw_index, read_index
from support.pictures import decode_each

from situp_annotate.video.annexb import read_head
from situp_annotate.video.picture_encoder import PictureEncoder

STEP_NS = 33_366_667


def encode(images, *, crf=23, times_ns=None):
    height, width = images[0].shape[:2]
    encoder = PictureEncoder(width=width, height=height, frame_rate=Fraction(30_000, 1001), crf=crf)
    times_ns = times_ns or [STEP_NS * k for k in range(len(images))]
    return [encoder.encode(image, time) for image, time in zip(images, times_ns, strict=True)]


@pytest.mark.parametrize("grey", [False, True])
@pytest.mark.parametrize("size_hw", [(48, 64), (47, 63)])
def test_each_picture_is_decodable_at_once(size_hw, grey):
    pictures = encode([draw_index(k, size_hw, grey=grey) for k in range(65)])
    images = decode_each(pictures, "h264")
    assert {image.shape for image in images} == {(48, 64, 3)}
    assert [read_index(image[: size_hw[0], : size_hw[1]]) for image in images] == [*range(65)]


def test_keyframes_come_every_second_with_their_parameter_sets():
    heads = [read_head(picture, "h264") for picture in encode([draw_index(0)] * 65)]
    keyframes = [index for index, head in enumerate(heads) if head.keyframe]
    assert keyframes == [0, 30, 60]
    assert all(heads[index].parameter_sets for index in keyframes)


def test_decoding_can_start_at_any_keyframe():
    pictures = encode([draw_index(k) for k in range(65)])
    starts = [k for k, picture in enumerate(pictures) if read_head(picture, "h264").keyframe]
    assert len(starts) > 2
    for start in starts:
        images = decode_each(pictures[start:], "h264")
        assert [read_index(image) for image in images] == [*range(start, 65)]


def test_times_may_be_uneven_and_very_close():
    times_ns = [0, 1, 2, 5_000_000_000, 5_000_000_001]
    pictures = encode([draw_index(k) for k in range(5)], times_ns=times_ns)
    assert [read_index(image) for image in decode_each(pictures, "h264")] == [*range(5)]


def test_quality_follows_the_crf():
    noise = np.random.default_rng(1).integers(0, 255, (96, 128, 3), np.uint8)
    sizes = [len(encode([noise], crf=crf)[0]) for crf in (1, 23, 51)]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] > 2 * sizes[2]
