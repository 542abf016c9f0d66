"""Decoding with OpenCV's FFmpeg: the decoder of choice."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np

from situp_annotate.errors import VideoIncompleteError
from situp_annotate.types import Image
from situp_annotate.video.formats import FILE_ONLY_FOR_OPENCV

__all__ = ["OpenCvDecoder"]

# Broken packets in a row after which the rest is given up.
_PATIENCE = 64

_OPTIONS = "OPENCV_FFMPEG_CAPTURE_OPTIONS"


@contextmanager
def _file_only() -> Iterator[None]:
    """Have OpenCV open nothing but video files, here and not wherever else it is used."""
    outside = os.environ.get(_OPTIONS)
    os.environ[_OPTIONS] = FILE_ONLY_FOR_OPENCV
    try:
        yield
    finally:
        del os.environ[_OPTIONS]
        if outside is not None:
            os.environ[_OPTIONS] = outside


class OpenCvDecoder:
    """One stream read from its start with ``cv2.VideoCapture``, one thread, never seeking.

    Parameters
    ----------
    path : Path
        An absolute path: FFmpeg reads ``name:rest`` as a protocol otherwise.
    coded_pictures : int
        How many the file holds. ``grab`` fails in the same way at a broken packet and at the
        end; it is worth another try only while pictures are missing.
    grey : bool
        Whether the stream is grey. OpenCV decodes such a stream to three equal channels.
    """

    name = "opencv"

    def __init__(self, path: Path, *, coded_pictures: int, grey: bool) -> None:
        # FFmpeg's own lines on stderr name no file; what they mean is reported as findings.
        os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
        one_thread = [cv2.CAP_PROP_N_THREADS, 1]
        with _file_only():
            self._capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG, one_thread)
        # On by default since OpenCV 4.5, but builds differ.
        self._path = path
        self._capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 1)
        self.rotation_degrees = round(self._capture.get(cv2.CAP_PROP_ORIENTATION_META)) % 360
        self._missing = coded_pictures
        self._grey = grey
        self._grabbed = 0

    def advance(self) -> bool:
        """Go to the next picture, past broken packets where some follow."""
        # Without a first picture the codec is probably not there: no use in trying on.
        tries = min(self._missing, _PATIENCE) if self._grabbed else 1
        for _ in range(max(tries, 1)):
            self._missing -= 1
            if self._capture.grab():
                self._grabbed += 1
                return True
        return False

    @property
    def time_ns(self) -> int | None:
        """Time of this picture from the start of the stream; None when it carries none."""
        milliseconds = self._capture.get(cv2.CAP_PROP_POS_MSEC)
        # OpenCV says 0 of a picture without a time.
        if milliseconds == 0 and self._grabbed > 1:
            return None
        return round(milliseconds * 1e6)

    @property
    def size_hw(self) -> tuple[int, int]:
        """Height and width in pixels: always the first picture's, OpenCV rescales to it."""
        return (
            round(self._capture.get(cv2.CAP_PROP_FRAME_HEIGHT)),
            round(self._capture.get(cv2.CAP_PROP_FRAME_WIDTH)),
        )

    def image(self) -> Image:
        """Return this picture, upright: (h, w) from a grey stream, else (h, w, 3) as B, G, R."""
        done, image = self._capture.retrieve()
        if not done:
            raise VideoIncompleteError(
                f"{self._path}: frame {self._grabbed - 1} decodes but cannot be converted to "
                "colours; convert the video, for instance to H.264."
            )
        return np.ascontiguousarray(image[:, :, 0] if self._grey else image, dtype=np.uint8)

    def close(self) -> None:
        """Free the file."""
        self._capture.release()
