"""Real clips: our frames are PyAV's, one by one."""

from itertools import zip_longest
from pathlib import Path

import av
import numpy as np

from situp_annotate.types import Image
from situp_annotate.video import open_video

_GRID = 8
_LUMA_OF_BGR = np.array([0.114, 0.587, 0.299])


def stored_luma(frame: av.VideoFrame) -> Image:
    """Brightness as stored, 16 to 235, at every eighth pixel."""
    plane = frame.planes[0]
    rows = np.frombuffer(plane, np.uint8).reshape(plane.height, plane.line_size)
    return rows[::_GRID, : frame.width : _GRID]


def test_indices_and_pictures_agree_with_pyav_on_every_clip(shared: Path) -> None:
    clips = sorted((shared / "clips").iterdir())
    assert clips
    for clip in clips:
        with open_video(clip) as source, av.open(str(clip)) as container:
            previous: Image | None = None
            decoded = container.decode(container.streams.video[0])
            for ours, theirs in zip_longest(source, decoded):
                assert ours is not None, f"{clip.name}: fewer frames than PyAV's"
                assert theirs is not None, f"{clip.name}: more frames than PyAV's"
                luma = 16 + 219 / 255 * (ours.image[::_GRID, ::_GRID] @ _LUMA_OF_BGR)
                stored = stored_luma(theirs).copy()
                off = np.abs(luma - stored).mean()
                off_from_previous = 255.0 if previous is None else np.abs(luma - previous).mean()
                assert off < min(3, off_from_previous), f"{clip.name}: not picture {ours.index}"
                previous = stored
