"""Folders of pictures, plain or in OTB's layout, as a source of frames."""

import os
import re
from pathlib import Path

import cv2
import imagesize
import numpy as np

from situp_annotate.errors import VideoFormatError, VideoIncompleteError, VideoMissingError
from situp_annotate.types import Image
from situp_annotate.video.bounds import too_large

__all__ = ["ImageFolderDecoder", "list_images", "natural_key"]

# A picture's file is read up to so many bytes: four channels in double precision, and what cameras
# and microscopes put beside them.
_BYTES_PER_PIXEL = 32
_OTHER_BYTES = 2**26

IMAGE_SUFFIXES = frozenset({".bmp", ".jpeg", ".jpg", ".png", ".tif", ".tiff", ".webp"})


def natural_key(text: str) -> tuple[tuple[str, int], ...]:
    """Sort key that puts ``2`` before ``10``, whatever stands around the numbers."""
    parts = re.findall(r"([^0-9]*)([0-9]*)", text.casefold())
    return tuple((word, int(number or -1)) for word, number in parts)


def list_images(folder: Path) -> list[Path]:
    """List the pictures of a folder, or of its ``img`` (OTB's layout), in natural order.

    Whatever has a picture's name is one, but for folders: where a link leads nowhere, a frame is
    missing. Returns an empty list for a folder without pictures.
    """
    for place in (folder / "img", folder):
        if place.is_dir():
            found = [path for path in place.iterdir() if _is_image(path)]
            if found:
                # The plain name settles ties such as 1.png and 01.png.
                return sorted(found, key=lambda path: (natural_key(path.name), path.name))
    return []


def _is_image(path: Path) -> bool:
    hidden = path.name.startswith(".")
    return path.suffix.lower() in IMAGE_SUFFIXES and not hidden and not path.is_dir()


class ImageFolderDecoder:
    """The pictures of a folder, one after another.

    Parameters
    ----------
    folder : Path
        Holds the pictures, or an ``img`` with the pictures.
    max_pixels : int
        How large a picture may be.

    Raises
    ------
    VideoFormatError
        If there are no pictures.
    VideoMissingError
        If the folder cannot be read.
    """

    name = "images"

    def __init__(self, folder: Path, *, max_pixels: int) -> None:
        try:
            self.paths = list_images(folder)
        except OSError as error:
            raise VideoMissingError(
                f"{folder}: the folder cannot be read ({error.strerror}); correct its permissions."
            ) from error
        if not self.paths:
            raise VideoFormatError(
                f"{folder}: the folder holds no pictures ({', '.join(sorted(IMAGE_SUFFIXES))}), "
                "neither itself nor in img/; name a video file or a folder of pictures."
            )
        self._max_pixels = max_pixels
        self.rotation_degrees = 0  # EXIF orientation is applied, picture by picture, in decoding
        self._folder = folder
        self._next = 0
        self._image: Image | None = None
        self._first_is_grey: bool | None = None

    def advance(self) -> bool:
        """Read the next picture.

        Raises
        ------
        VideoIncompleteError
            If it cannot be read.
        VideoTooLargeError
            If it has too many pixels.
        """
        if self._next == len(self.paths):
            self._image = None
            return False
        self._image = self.read(self._next)
        self._next += 1
        return True

    def read(self, index: int) -> Image:
        """Read any one picture; it is grey where the first one is.

        Raises
        ------
        VideoIncompleteError
            If it cannot be read.
        VideoTooLargeError
            If it has too many pixels.
        """
        if index > 0 and self._first_is_grey is None:
            self.read(0)
        path = self.paths[index]
        image = self._decode(path)
        if image is None:
            raise VideoIncompleteError(
                f"{self._folder}: picture {path.name} (frame {index} of {len(self.paths)}) "
                "cannot be read; replace it or remove it."
            )
        if index == 0:
            self._first_is_grey = image.ndim == 2
        return image

    def _decode(self, path: Path) -> Image | None:
        """Read a picture once its header has said that it is not too large."""
        if not path.is_file():  # a pipe makes whoever opens it wait
            return None
        try:
            with path.open("rb") as file:
                width, height = imagesize.get(file, exif_rotation=False)
                if width < 1 or height < 1:
                    return None
                if width * height > self._max_pixels:
                    which = f"picture {path.name}"
                    raise too_large(self._folder, which, (height, width), self._max_pixels)
                file.seek(0)
                most = _BYTES_PER_PIXEL * width * height + _OTHER_BYTES
                content = file.read(min(most, os.fstat(file.fileno()).st_size))
            # imdecode, as imread does not open paths beyond ASCII on Windows.
            decoded = cv2.imdecode(np.frombuffer(content, np.uint8), self._flags)
        except (OSError, cv2.error):
            return None
        return None if decoded is None else np.ascontiguousarray(decoded, dtype=np.uint8)

    @property
    def _flags(self) -> int:
        if self._first_is_grey is None:
            return cv2.IMREAD_ANYCOLOR  # grey stays grey; 8 bit; EXIF orientation applied
        return cv2.IMREAD_GRAYSCALE if self._first_is_grey else cv2.IMREAD_COLOR

    @property
    def time_ns(self) -> int | None:
        """None: pictures in a folder carry no time."""
        return None

    @property
    def size_hw(self) -> tuple[int, int]:
        """Height and width of this picture in pixels, upright."""
        height, width = self.image().shape[:2]
        return height, width

    def image(self) -> Image:
        """Return this picture, upright: (h, w) where the first one is grey, else (h, w, 3)."""
        assert self._image is not None, "advance() found a picture"
        return self._image

    def close(self) -> None:
        """Free the picture."""
        self._image = None
