"""What a browser's video element shows."""

import cv2
import numpy as np

from situp_annotate.formats.appearance import track_color
from support.media import read_index

__all__ = ["picture_of", "seek", "shown_box_left", "shown_index", "wait_for_seek"]

_SEEK = """([video, time]) => new Promise((done, fail) => {
  setTimeout(() => fail(new Error("the video did not seek")), 10000);
  video.addEventListener("seeked", () =>
    requestAnimationFrame(() => requestAnimationFrame(done)), { once: true });
  video.currentTime = time;
})"""
_SETTLED = """() => {
  const video = document.querySelector("video");
  return !video.seeking && video.readyState > 1;
}"""
_PAINTED = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


def seek(page, seconds):
    """Seek the page's video and wait until it shows the picture."""
    page.evaluate(_SEEK, [page.query_selector("video"), seconds])


def wait_for_seek(page):
    """Wait until the video shows what it was asked for."""
    page.wait_for_function(_SETTLED)
    page.evaluate(_PAINTED)


def picture_of(page):
    """The video element as it is on the screen, B, G, R."""
    encoded = np.frombuffer(page.locator("video").screenshot(), np.uint8)
    return cv2.imdecode(encoded, cv2.IMREAD_COLOR)


def shown_index(picture):
    """Number of the index picture that is shown."""
    return read_index(picture)


def shown_box_left(picture, track_id, rows):
    """First column of what is drawn in a track's colour, in pixels of the picture shown."""
    color = np.array(track_color(track_id)[::-1])
    near = np.abs(picture[rows].astype(int) - color).max(axis=2) < 70
    columns = np.flatnonzero(near.mean(axis=0) > 0.6)
    return int(columns[0])
