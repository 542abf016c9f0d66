"""What an overlay costs: CPU time a 720p frame, and wall time where it overlaps with decoding.

    python benchmarks/overlay.py --sequences FOLDER --json FILE [--frames 150]

FOLDER holds sequences in OTB layout. Each one's pictures, enlarged to 1280×720, are played to and
fro for so many frames, with the true box of one target and four more beside it. Drawing and
encoding at the default settings are counted apart, decoding is not. Then the overlay of the video
is made as `situp-annotate overlay` does it, with and without threads.
"""

import itertools
import json
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import click
import cv2
import numpy as np

from situp_annotate.evaluation import OtbSequence, find_sequences
from situp_annotate.finished.redrawing import redraw
from situp_annotate.formats.labelled import LabelledTrack, LabelledVideo
from situp_annotate.formats.overlay.options import OverlayOptions
from situp_annotate.formats.overlay.painter import Painter
from situp_annotate.types import (
    BoundingBox,
    Frame,
    Image,
    Keyframe,
    Provenance,
    State,
    Track,
    TrackPoint,
)
from situp_annotate.video import open_video
from situp_annotate.video.writer import H264Writer

WIDTH, HEIGHT = 1280, 720
RATE = Fraction(25)
STEP_NS = 1_000_000_000 // 25
TRACKS = 5
ASIDE = 40
"""Pixels from one target's box to the next one's."""


@dataclass(frozen=True)
class Cost:
    """Milliseconds of CPU time a frame.

    Attributes
    ----------
    draw_1, draw_5 : float
        Drawing the labels of one target and of five.
    encode : float
        Converting and encoding.
    """

    draw_1: float
    draw_5: float
    encode: float

    @property
    def overlay(self) -> float:
        """Of an overlay with one target."""
        return self.draw_1 + self.encode


def to_and_fro(count: int) -> Iterator[int]:
    """Indices of so many frames from the first to the last, back, and so on without end."""
    return itertools.cycle([*range(count), *range(count - 2, 0, -1)])


def large(image: Image) -> Image:
    """The picture in colour, 1280×720."""
    color = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image
    return np.asarray(cv2.resize(color, (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC), np.uint8)


def load(sequence: OtbSequence, count: int) -> tuple[list[Image], list[list[TrackPoint]]]:
    """Pictures and labels of so many frames."""
    with open_video(sequence.folder) as source:
        pictures = [frame.image for frame in itertools.islice(source, count)]
    height, width = pictures[0].shape[:2]
    truth = sequence.targets[0].truth[: len(pictures)] - (1, 1, 0, 0)
    boxes = truth * (WIDTH / width, HEIGHT / height, WIDTH / width, HEIGHT / height)
    known = np.flatnonzero(np.isfinite(boxes).all(axis=1)).tolist()
    places = [known[step] for step in itertools.islice(to_and_fro(len(known)), count)]
    enlarged = [large(picture) for picture in pictures]
    return [enlarged[place] for place in places], [labels(boxes[place]) for place in places]


def labels(box: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> list[TrackPoint]:
    """Five labels, the first of them true."""
    x, y, width, height = map(float, box)
    return [
        TrackPoint(
            number + 1,
            BoundingBox(x + ASIDE * number, y + ASIDE * number, width, height),
            0.87 + 0.01 * number,
            State.VISIBLE,
            Provenance.TRACKED,
        )
        for number in range(TRACKS)
    ]


def milliseconds(work: Callable[[], None], frames: int) -> float:
    """CPU time a frame, of all threads."""
    start = time.process_time()
    work()
    return 1000 * (time.process_time() - start) / frames


def tracks_of(points: list[TrackPoint]) -> list[Track]:
    """Tracks for these labels."""
    return [Track(p.track_id, "person", (Keyframe(0, p.box),)) for p in points]


def cost_of(pictures: list[Image], points: list[list[TrackPoint]], path: Path) -> Cost:
    """Draw and encode, each on its own."""
    frames = [Frame(n, n * STEP_NS, picture) for n, picture in enumerate(pictures)]
    options = OverlayOptions()
    drawn: list[Image] = []

    def draw(count: int) -> None:
        painter = Painter(tracks_of(points[0][:count]), (HEIGHT, WIDTH), options)
        drawn[:] = [
            painter.paint(frame, of_frame) for frame, of_frame in zip(frames, points, strict=True)
        ]

    def encode() -> None:
        with H264Writer(
            path,
            width=WIDTH,
            height=HEIGHT,
            frame_rate=RATE,
            crf=options.crf,
            preset=options.preset,
        ) as writer:
            for frame, picture in zip(frames, drawn, strict=True):
                writer.write(picture, frame.pts_ns)

    draw(1)  # loads the font
    draw_5 = milliseconds(lambda: draw(TRACKS), len(frames))
    draw_1 = milliseconds(lambda: draw(1), len(frames))
    return Cost(draw_1, draw_5, milliseconds(encode, len(frames)))


def labelled(path: Path, points: list[list[TrackPoint]]) -> LabelledVideo:
    """The video at a path with one target's labels."""
    with open_video(path) as source:
        info = source.info
    of_track = {number: of_frame[0] for number, of_frame in enumerate(points)}
    (track,) = tracks_of(points[0][:1])
    return LabelledVideo("clip", info, len(points), {}, (LabelledTrack(track, of_track),))


def overlap(folder: Path, pictures: list[Image], points: list[list[TrackPoint]]) -> float:
    """Wall time of an overlay with threads over that without; the median of three."""
    source = folder / "source.mp4"
    with H264Writer(source, width=WIDTH, height=HEIGHT, frame_rate=RATE, preset="medium") as writer:
        for number, picture in enumerate(pictures):
            writer.write(picture, number * STEP_NS)
    video = labelled(source, points)
    options = replace(OverlayOptions(), sound=False)
    ratios = []
    for _ in range(3):
        seconds = []
        for threads in (1, 2):
            start = time.perf_counter()
            redraw(video, folder / "overlay.mp4", options, threads=threads)
            seconds.append(time.perf_counter() - start)
        ratios.append(seconds[1] / seconds[0])
    return statistics.median(ratios)


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path), required=True)
@click.option("--frames", type=click.IntRange(min=10), default=150, show_default=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
def main(sequences: Path, frames: int, json_path: Path) -> None:
    """Measure, print and write the figures."""
    cv2.setNumThreads(1)
    costs, ratios = {}, {}
    for sequence in find_sequences(sequences):
        pictures, points = load(sequence, frames)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            cost = costs[sequence.name] = cost_of(pictures, points, folder / "cost.mp4")
            ratios[sequence.name] = overlap(folder, pictures, points)
        print(
            f"{sequence.name}: draw {cost.draw_1:.1f} ms (five targets {cost.draw_5:.1f}), encode "
            f"{cost.encode:.1f} ms; with threads {ratios[sequence.name]:.2f} of the time"
        )
    bars = {
        "overlay_cpu_ms_720p": statistics.median(cost.overlay for cost in costs.values()),
        "overlay_cpu_ms_720p_worst": max(cost.overlay for cost in costs.values()),
        "overlapped_over_serial": statistics.median(ratios.values()),
    }
    print(json.dumps(bars, indent=2))
    figures = {"bars": bars, "cpu_ms": {name: vars(cost) for name, cost in costs.items()}}
    json_path.write_text(json.dumps({**figures, "overlap": ratios}, indent=2) + "\n")


if __name__ == "__main__":
    main()
