"""Pictures in folders: their order, and how they are read."""

import os
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image as PillowImage
from support.media import draw_index, read_index, write_image_folder

from situp_annotate.errors import VideoIncompleteError
from situp_annotate.video.image_folder import ImageFolderDecoder, list_images, natural_key

Spoil = Callable[[Path], object]


def test_natural_order() -> None:
    names = ["b1", "a10", "a2", "A1", "a", "10", "9", "a2b10", "a2b9"]
    assert sorted(names, key=natural_key) == [
        *("9", "10", "a", "A1", "a2", "a2b9", "a2b10", "a10", "b1"),
    ]


@pytest.mark.parametrize("suffix", [".jpg", ".JPEG", ".png", ".bmp", ".tif", ".tiff", ".webp"])
def test_every_kind_of_picture(suffix: str, tmp_path: Path) -> None:
    write_image_folder(tmp_path, count=2, suffix=suffix)
    decoder = ImageFolderDecoder(tmp_path, max_pixels=10**6)
    assert decoder.advance()
    assert decoder.advance()
    assert read_index(decoder.image()) == 1
    assert decoder.image().shape == (48, 64, 3)
    assert decoder.image()[6, 8] == pytest.approx((40, 200, 240), abs=25)
    assert not decoder.advance()


def test_other_files_are_passed_over(tmp_path: Path) -> None:
    write_image_folder(tmp_path, count=2)
    for name in ("notes.txt", ".3.png", "thumbs.db"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "4.png").mkdir()
    assert [path.name for path in list_images(tmp_path)] == ["1.png", "2.png"]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda path: path.write_bytes(b""),
        lambda path: path.write_text("no picture"),
        lambda path: path.write_bytes(b"v/1\x01" + bytes(99)),
        lambda path: path.symlink_to("nowhere.png"),
        lambda path: path.symlink_to(path.name),
        lambda path: os.mkfifo(path),
    ],
    ids=["empty", "text", "another format", "broken link", "loop", "pipe"],
)
def test_whatever_has_the_name_of_a_picture_has_its_place(spoil: Spoil, tmp_path: Path) -> None:
    write_image_folder(tmp_path, count=3)
    (tmp_path / "2.png").unlink()
    spoil(tmp_path / "2.png")
    decoder = ImageFolderDecoder(tmp_path, max_pixels=10**6)
    assert decoder.advance()
    with pytest.raises(VideoIncompleteError, match=r"2\.png \(frame 1 of 3\) cannot be read"):
        decoder.advance()


def test_sixteen_bits_become_eight(tmp_path: Path) -> None:
    deep = draw_index(3, grey=True).astype(np.uint16) * 256
    assert cv2.imwrite(str(tmp_path / "1.png"), deep)
    decoder = ImageFolderDecoder(tmp_path, max_pixels=10**6)
    decoder.advance()
    assert decoder.image().dtype == np.uint8
    assert decoder.image().ndim == 2
    assert read_index(decoder.image()) == 3


def test_transparency_is_dropped(tmp_path: Path) -> None:
    opaque = np.dstack([draw_index(3), np.full((48, 64), 255, np.uint8)])
    assert cv2.imwrite(str(tmp_path / "1.png"), opaque)
    decoder = ImageFolderDecoder(tmp_path, max_pixels=10**6)
    decoder.advance()
    assert np.array_equal(decoder.image(), draw_index(3))


def test_exif_orientation_is_applied_once(tmp_path: Path) -> None:
    turned = np.ascontiguousarray(np.rot90(draw_index(5))[:, :, ::-1])
    exif = PillowImage.Exif()
    exif[0x0112] = 6  # turn by 90° clockwise to show
    PillowImage.fromarray(turned).save(tmp_path / "1.jpg", exif=exif, quality=95)
    decoder = ImageFolderDecoder(tmp_path, max_pixels=10**6)
    decoder.advance()
    assert decoder.size_hw == (48, 64)
    assert read_index(decoder.image()) == 5


@pytest.mark.parametrize("first_is_grey", [True, False])
def test_all_pictures_have_the_channels_of_the_first(first_is_grey: bool, tmp_path: Path) -> None:
    for name, grey in (("1.png", first_is_grey), ("2.png", not first_is_grey)):
        assert cv2.imwrite(str(tmp_path / name), draw_index(1, grey=grey))
    decoder = ImageFolderDecoder(tmp_path, max_pixels=10**6)
    decoder.advance()
    first = decoder.image()
    decoder.advance()
    assert decoder.image().shape == first.shape
