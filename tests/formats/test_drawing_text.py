"""Text in pictures: what is written, in which colours, and where it is cut off."""

import cv2
import numpy as np
import pytest

from situp_annotate.formats.overlay.text import DARK, paste, text_tag

GREEN = (40, 220, 30)


@pytest.mark.parametrize("size", [12, 24, 72])
def test_tags_of_a_size_are_as_high(size):
    heights = {text_tag(text, size, GREEN).shape[0] for text in ("a", "#1 van 0.87", "Ç", "")}
    assert heights == {round(1.25 * size)}


def test_ink_is_dark_on_light_and_light_on_dark():
    light, dark = text_tag("W", 24, (200, 255, 255)), text_tag("W", 24, DARK)
    assert light.min() <= 25
    assert dark.max() >= 250
    assert tuple(light[0, 0]) == (200, 255, 255)
    assert tuple(dark[0, 0]) == DARK


def test_characters_stand_beside_each_other():
    both, first, second = (text_tag(text, 24, GREEN) for text in ("aW", "a", "W"))
    np.testing.assert_array_equal(both, np.hstack([first, second]))


def test_a_margin_is_ground():
    bare, wide = (text_tag("a", 24, GREEN, margin=margin) for margin in (0, 5))
    np.testing.assert_array_equal(wide[:, 5:-5], bare)
    assert (wide[:, :5] == GREEN).all()


def test_what_is_not_printable_is_a_space():
    np.testing.assert_array_equal(text_tag("a\tb", 24, GREEN), text_tag("a b", 24, GREEN))


@pytest.mark.skipif(not hasattr(cv2, "FontFace"), reason="OpenCV 4 has no font for more")
def test_letters_beyond_ascii_are_not_boxes():
    assert (text_tag("ä", 24, GREEN) != text_tag("ß", 24, GREEN)[:, :1]).any()


def test_pasting_cuts_off_at_the_edge():
    image, piece = np.zeros((10, 12, 3), np.uint8), np.full((4, 5, 3), 9, np.uint8)
    paste(image, piece, (9, 8))
    assert (image[8:, 9:] == 9).all()
    assert image.sum() == 9 * 3 * 2 * 3
