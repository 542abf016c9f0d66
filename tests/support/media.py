"""Small video files, sound and broken, whose pictures tell their own index.

Every picture is a grid of 4 × 4 cells, light or dark. The corners say which way is up (only the
top-left one is light); the other twelve spell the index in binary. ``read_index`` reads it back,
so a test can prove that the *picture* at index k is picture k, upright.
"""

import random
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import av.container
import av.packet
import av.video
import cv2
import numpy as np

from situp_annotate.types import Image

__all__ = [
    "LIGHT_BGR",
    "decode_with_pyav",
    "draw_index",
    "flip_bits",
    "punch_hole",
    "read_index",
    "remux",
    "truncate",
    "write_audio_only",
    "write_av1",
    "write_cut",
    "write_empty_video",
    "write_image_folder",
    "write_size_change",
    "write_still_end",
    "write_trimmed_end",
    "write_unknown_sound",
    "write_video",
]

LIGHT_BGR = (40, 200, 240)
DARK_BGR = (90, 40, 20)
_GRID = 4
_CORNERS = (0, 3, 12, 15)
_DATA_CELLS = tuple(cell for cell in range(_GRID * _GRID) if cell not in _CORNERS)
_CODECS = {".avi": "mpeg4", ".webm": "libvpx"}


def draw_index(index: int, size_hw: tuple[int, int] = (48, 64), *, grey: bool = False) -> Image:
    """Draw picture ``index`` (0 to 4095), BGR or grey."""
    cells = np.zeros(_GRID * _GRID, dtype=bool)
    cells[0] = True
    for bit, cell in enumerate(_DATA_CELLS):
        cells[cell] = bool(index >> bit & 1)
    height, width = size_hw
    rows = np.arange(height) * _GRID // height
    columns = np.arange(width) * _GRID // width
    mask = cells.reshape(_GRID, _GRID)[np.ix_(rows, columns)]
    if grey:
        return np.where(mask, 220, 40).astype(np.uint8)
    return np.where(mask[..., None], LIGHT_BGR, DARK_BGR).astype(np.uint8)


def read_index(image: Image) -> int:
    """Read the index that ``draw_index`` drew; fails on a picture that is not upright."""
    luma = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    height, width = luma.shape
    cells = [
        luma[
            (2 * row + 1) * height // (2 * _GRID) - 1 : (2 * row + 1) * height // (2 * _GRID) + 1,
            (2 * column + 1) * width // (2 * _GRID) - 1 : (2 * column + 1) * width // (2 * _GRID)
            + 1,
        ].mean()
        > 125
        for row in range(_GRID)
        for column in range(_GRID)
    ]
    corners = [cells[corner] for corner in _CORNERS]
    assert corners == [True, False, False, False], f"no upright index picture: corners {corners}"
    return sum(int(cells[cell]) << bit for bit, cell in enumerate(_DATA_CELLS))


def write_video(
    path: Path,
    images: Iterable[Image] | None = None,
    *,
    count: int = 60,
    size_hw: tuple[int, int] = (48, 64),
    codec: str | None = None,
    pixel_format: str = "yuv420p",
    rate: int | Fraction = 30,
    pts: Sequence[int] | None = None,
    time_base: Fraction | None = None,
    b_frames: int = 0,
    gop: int = 15,
    rotation_degrees: int = 0,
    pixel_aspect_ratio: Fraction | None = None,
    audio_seconds: float = 0.0,
    options: dict[str, str] | None = None,
    container_options: dict[str, str] | None = None,
    container_format: str | None = None,
) -> Path:
    """Encode pictures, by default ``count`` index pictures, into a video file.

    Parameters
    ----------
    path : Path
        File to write; its suffix chooses the container and, without `codec`, the codec.
    images : iterable of Image, optional
        BGR or grey pictures, instead of index pictures.
    codec : str, optional
        Name of an FFmpeg encoder; libx264 where the container allows it.
    pts : sequence of int, optional
        Presentation time of each picture in `time_base`; for a variable frame rate.
    time_base : Fraction, optional
        Seconds a tick; one tick a picture by default.
    b_frames : int
        B-frames between two others; 0 for none.
    rotation_degrees : int
        Clockwise turn that a player must make to show the pictures upright: the stored
        pictures are turned the other way.
    audio_seconds : float
        Length of a silent sound track; 0 for none.

    Returns
    -------
    Path
        `path`.
    """
    pictures = _index_pictures(count, size_hw, pixel_format) if images is None else images
    turns = rotation_degrees // 90
    with av.open(
        str(path), "w", format=container_format, container_options=container_options or {}
    ) as container:
        stream = container.add_stream(codec or _CODECS.get(path.suffix, "libx264"), rate=rate)
        stream.pix_fmt = pixel_format
        stream.codec_context.time_base = time_base or Fraction(1) / rate
        stream.codec_context.gop_size = gop
        stream.codec_context.thread_count = 1
        stream.codec_context.options = {"bf": str(b_frames), **(options or {})}
        if pixel_aspect_ratio is not None:
            stream.codec_context.sample_aspect_ratio = pixel_aspect_ratio
        if rotation_degrees:
            stream.set_display_rotation(-rotation_degrees)  # PyAV counts anticlockwise
        sound = container.add_stream("aac", rate=8000) if audio_seconds else None
        for index, image in enumerate(pictures):
            frame = _to_frame(np.rot90(image, turns))  # stored turned back, anticlockwise
            if index == 0:
                stream.width, stream.height = frame.width, frame.height
            frame.pts = index if pts is None else pts[index]
            frame.time_base = stream.codec_context.time_base
            container.mux(stream.encode(frame.reformat(format=pixel_format)))
        container.mux(stream.encode(None))
        if sound is not None:
            _write_silence(container, sound, audio_seconds)
    return path


def write_av1(path: Path, *, count: int) -> Path:
    """Write `count` index pictures as AV1, in a process of its own.

    SVT-AV1 gives the threads of root real-time priority for good, and processes that they start
    inherit it: busy workers would starve each other's threads.
    """
    code = (
        "import sys; from pathlib import Path; from support.media import write_video;"
        f"write_video(Path(sys.argv[1]), count={count}, codec='libsvtav1', gop={count},"
        "options={'preset': '12'})"
    )
    tests = Path(__file__).parents[1]
    command = [sys.executable, "-c", code, str(path.absolute())]
    subprocess.run(command, check=True, cwd=tests, capture_output=True)
    return path


def write_audio_only(path: Path, seconds: float = 1.0) -> Path:
    """Write a file with sound and no picture."""
    with av.open(str(path), "w") as container:
        _write_silence(container, container.add_stream("aac", rate=8000), seconds)
    return path


def write_unknown_sound(path: Path) -> Path:
    """Write an AVI of 60 index pictures with sound in a format that nobody knows."""
    content = bytearray(write_video(path, audio_seconds=2).read_bytes())
    tag = content.index(b"strf", content.index(b"auds")) + 8
    content[tag : tag + 2] = b"\x34\x12"
    path.write_bytes(content)
    return path


def write_empty_video(path: Path) -> Path:
    """Write a valid file whose video track has no picture."""
    # Only a fragmented mp4 writes down its tracks before there is a picture.
    with av.open(str(path), "w", container_options={"movflags": "empty_moov"}) as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        container.start_encoding()
    return path


def write_cut(source: Path, path: Path, start_seconds: float, **container_options: str) -> Path:
    """Copy from `start_seconds` on without encoding, as ``ffmpeg -ss … -c copy`` does.

    The copy starts at the keyframe before; in mp4 an edit list hides what comes before the cut.
    """
    with (
        av.open(str(source)) as reader,
        av.open(str(path), "w", container_options=container_options) as writer,
    ):
        original = reader.streams.video[0]
        copy = writer.add_stream_from_template(original)
        assert original.time_base is not None
        start = round(start_seconds / original.time_base)
        reader.seek(start, stream=original)
        for packet in reader.demux(original):
            if packet.dts is None or packet.pts is None:
                continue
            packet.pts, packet.dts = packet.pts - start, packet.dts - start
            packet.stream = copy
            writer.mux(packet)
    return path


def remux(source: Path, path: Path) -> Path:
    """Copy the pictures of a video into another container without encoding."""
    with av.open(str(source)) as reader, av.open(str(path), "w") as writer:
        original = reader.streams.video[0]
        copy = writer.add_stream_from_template(original)
        for packet in reader.demux(original):
            if packet.dts is not None:
                packet.stream = copy
                writer.mux(packet)
    return path


def write_still_end(source: Path, path: Path, seconds: float) -> Path:
    """Copy a video without encoding and let its last picture stand for `seconds`."""
    with av.open(str(source)) as reader, av.open(str(path), "w") as writer:
        original = reader.streams.video[0]
        copy = writer.add_stream_from_template(original)
        packets = [packet for packet in reader.demux(original) if packet.dts is not None]
        assert original.time_base is not None
        packets[-1].duration = round(seconds / original.time_base)
        for packet in packets:
            packet.stream = copy
            writer.mux(packet)
    return path


def write_trimmed_end(source: Path, path: Path, seconds: float) -> Path:
    """Copy an mp4 and shorten what its edit list shows of it; the pictures stay in the file."""
    content = bytearray(source.read_bytes())
    duration = content.index(b"elst") + 12  # after version, flags and the number of entries
    content[duration : duration + 4] = round(seconds * 1000).to_bytes(4, "big")
    path.write_bytes(content)
    return path


def write_size_change(path: Path, *, first: int = 20, second: int = 20, **options: Any) -> Path:
    """Write one stream of `first` pictures of 64 × 48 pixels and `second` of 96 × 80."""
    step, ticks = 3000, Fraction(1, 90000)
    sizes = [(48, 64)] * first + [(80, 96)] * second
    parts = []
    for name, numbers in (("a", range(first)), ("b", range(first, first + second))):
        pictures = [draw_index(number, sizes[number]) for number in numbers]
        part = path.with_suffix(f".{name}{path.suffix}")
        times = [number * step for number in numbers]
        parts.append(write_video(part, pictures, pts=times, time_base=ticks, **options))
    with av.open(str(parts[0])) as reader, av.open(str(path), "w") as writer:
        stream = writer.add_stream_from_template(reader.streams.video[0])
        for part in parts:
            with av.open(str(part)) as pieces:
                for packet in pieces.demux(pieces.streams.video[0]):
                    if packet.dts is not None:
                        packet.stream = stream
                        writer.mux(packet)
    return path


def truncate(source: Path, path: Path, share: float) -> Path:
    """Copy the first `share` of the bytes of a file."""
    content = source.read_bytes()
    path.write_bytes(content[: int(len(content) * share)])
    return path


def flip_bits(source: Path, path: Path, seed: int, count: int = 30) -> Path:
    """Copy a file with so many bits turned round, anywhere in it."""
    content = bytearray(source.read_bytes())
    chance = random.Random(seed)
    for _ in range(count):
        content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    path.write_bytes(content)
    return path


def punch_hole(source: Path, path: Path, start: float, stop: float, unit: int = 188) -> Path:
    """Copy a file without the bytes between two shares, rounded to units (188: MPEG-TS packets)."""
    content = source.read_bytes()
    first, last = (int(len(content) * share) // unit * unit for share in (start, stop))
    path.write_bytes(content[:first] + content[last:])
    return path


def write_image_folder(
    folder: Path,
    count: int = 12,
    *,
    size_hw: tuple[int, int] = (48, 64),
    suffix: str = ".png",
    digits: int = 1,
    grey: bool = False,
) -> Path:
    """Write index pictures named 1, 2, … with at least `digits` digits."""
    folder.mkdir(parents=True, exist_ok=True)
    for index in range(count):
        name = folder / f"{index + 1:0{digits}}{suffix}"
        assert cv2.imwrite(str(name), draw_index(index, size_hw, grey=grey))
    return folder


def decode_with_pyav(path: Path) -> tuple[list[Fraction | None], list[int]]:
    """Decode plainly with PyAV: times in seconds from the stream's start, and picture numbers."""
    times: list[Fraction | None] = []
    numbers: list[int] = []
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        start = stream.start_time or 0
        for frame in container.decode(stream):
            known = frame.pts is not None and frame.time_base is not None
            times.append((frame.pts - start) * frame.time_base if known else None)
            numbers.append(read_index(frame.to_ndarray(format="gray")))
    return times, numbers


def _index_pictures(count: int, size_hw: tuple[int, int], pixel_format: str) -> Iterator[Image]:
    grey = pixel_format.startswith("gray")
    return (draw_index(index, size_hw, grey=grey) for index in range(count))


def _to_frame(image: Image) -> av.VideoFrame:
    pixel_format = "gray" if image.ndim == 2 else "bgr24"
    return av.VideoFrame.from_ndarray(np.ascontiguousarray(image), format=pixel_format)


def _write_silence(
    container: av.container.OutputContainer, stream: av.AudioStream, seconds: float
) -> None:
    for start in range(0, int(seconds * 8000), 1024):
        frame = av.AudioFrame.from_ndarray(
            np.zeros((1, 1024), dtype=np.float32), format="fltp", layout="mono"
        )
        frame.sample_rate, frame.pts, frame.time_base = 8000, start, Fraction(1, 8000)
        container.mux(stream.encode(frame))
    container.mux(stream.encode(None))
