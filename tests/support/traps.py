"""Video files with what bites labelers: mirrored, interlaced, several streams, odd times."""

from fractions import Fraction
from pathlib import Path

import av

from situp_annotate.types import Image
from support.media import draw_index, punch_hole, write_video

__all__ = [
    "write_mirrored",
    "write_two_streams",
    "write_uneven",
    "write_without_first_keyframe",
    "write_wrong_header_rate",
]

_MIRROR = [-65536, 0, 0, 0, 65536, 0, 64 << 16, 0, 1 << 30]
_FLIP = [65536, 0, 0, 0, -65536, 0, 0, 48 << 16, 1 << 30]


def _frame(image: Image, index: int) -> av.VideoFrame:
    frame = av.VideoFrame.from_ndarray(image, format="bgr24").reformat(format="yuv420p")
    frame.pts, frame.time_base = index, Fraction(1, 30)
    return frame


def write_mirrored(path: Path, *, upside_down: bool = False) -> Path:
    """Write a video that asks to be shown as in a mirror, or in a lake."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=30, options={"bf": "0"})
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        stream.set_display_matrix(_FLIP if upside_down else _MIRROR)
        for index in range(10):
            container.mux(stream.encode(_frame(draw_index(index), index)))
        container.mux(stream.encode(None))
    return path


def write_two_streams(path: Path) -> Path:
    """Write a file with two streams of moving pictures, of 64 × 48 and of 32 × 24 pixels."""
    with av.open(str(path), "w") as container:
        streams = []
        for size_hw in ((48, 64), (24, 32)):
            stream = container.add_stream("libx264", rate=30, options={"bf": "0"})
            stream.height, stream.width = size_hw
            stream.pix_fmt = "yuv420p"
            streams.append((stream, size_hw))
        for index in range(10):
            for stream, size_hw in streams:
                container.mux(stream.encode(_frame(draw_index(index, size_hw), index)))
        for stream, _ in streams:
            container.mux(stream.encode(None))
    return path


def write_uneven(path: Path) -> Path:
    """Write 120 pictures whose steps grow by 6 % halfway: even enough to pass for constant."""
    pts = [index * 100 if index < 60 else 6000 + (index - 60) * 106 for index in range(120)]
    return write_video(path, count=120, pts=pts, time_base=Fraction(1, 3000))


def write_without_first_keyframe(path: Path) -> Path:
    """Write an MPEG-TS that begins in the middle of a group of pictures."""
    whole = write_video(path.with_name("whole.ts"), count=60)
    return punch_hole(whole, path, 0.0, 0.1)


def write_wrong_header_rate(path: Path) -> Path:
    """Write an AVI whose header says twice the rate at which it holds pictures."""
    return write_video(
        path, codec="mpeg4", rate=60, pts=[2 * index for index in range(40)], count=40
    )
