"""How long a browser needs to open the review report, and how large its pages are.

    python benchmarks/report.py --json FILE [--sequences FOLDER] [--videos 200]

Writes the pages of a batch of so many videos, each with some tracks, of generated labels, and one
page of 18 000 frames and twenty tracks; then opens the index and video pages in a headless Chromium
(on the PATH, or named by SITUP_CHROMIUM), each in a fresh context, and reads from the browser's own
clock when the page had loaded and its script had run, and how long the first sort then takes.
FOLDER holds sequences in OTB layout: with it, the pages of their true boxes, thinned to every
hundredth and interpolated, are made from their pictures and opened, too.
"""

import json
import os
import shutil
import statistics
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from fractions import Fraction
from pathlib import Path

import click
import cv2
import numpy as np
from playwright.sync_api import Browser, sync_playwright

from situp_annotate.evaluation import OtbSequence, find_sequences
from situp_annotate.propagation import (
    FramesInMemory,
    Labels,
    PropagationOptions,
    Survey,
    propagate,
    suggest,
)
from situp_annotate.report import ReportSink, TrackRow, VideoRow, index_html, profile
from situp_annotate.report.strips import Samples, figures_of, samples_of
from situp_annotate.types import (
    BoundingBox,
    Frame,
    Image,
    Keyframe,
    Method,
    State,
    Track,
    VideoInfo,
)
from situp_annotate.video import ForwardWalk, open_video

PAGE = "report.html"
FILES = ("annotations.mcap", "mot.csv", "overlay.mp4", PAGE, "review.csv", "summary.json")
SIZE_HW = (360, 640)
RATE = Fraction(30)
LABELS = ("car", "bus", "person on foot", "cyclist", "van")
ARGUMENTS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
]  # fmt: skip
READY = """() => {
  const [page] = performance.getEntriesByType("navigation");
  const paint = performance.getEntriesByName("first-contentful-paint")[0];
  return { interactive: page.domInteractive, loaded: page.loadEventEnd, paint: paint?.startTime };
}"""
SORT = """() => {
  const start = performance.now();
  document.querySelector("th[data-key=frames] button").click();
  document.body.offsetHeight;
  return performance.now() - start;
}"""


@dataclass(frozen=True)
class Opened:
    """What it took to open a page: the median of several times.

    Attributes
    ----------
    name : str
        Which page.
    megabytes : float
        Its size.
    interactive_s, loaded_s, painted_s : float
        Seconds from the start until the script has run, all is loaded, and something is seen.
    """

    name: str
    megabytes: float
    interactive_s: float
    loaded_s: float
    painted_s: float


def generated_tracks(random: np.random.Generator, count: int, frames: int) -> list[Track]:
    """Tracks with a keyframe every few seconds, some of them hidden in places."""
    tracks = []
    for number in range(1, count + 1):
        keyframes = []
        for frame in range(int(random.integers(0, 90)), frames, int(random.integers(60, 400))):
            x, y = random.uniform(0, 560), random.uniform(0, 300)
            width, height = random.uniform(20, 120, 2)
            hidden = bool(random.random() < 0.15)
            keyframes.append(Keyframe(frame, BoundingBox(x, y, width, height), hidden))
        tracks.append(Track(number, str(random.choice(LABELS)), tuple(keyframes)))
    return tracks


def noise(random: np.random.Generator, size_hw: tuple[int, int]) -> Image:
    """A picture as rich in detail as a video's: the worst for the size of thumbnails."""
    small = random.integers(0, 256, (size_hw[0] // 4, size_hw[1] // 4, 3), dtype=np.uint8)
    return np.asarray(cv2.resize(small, size_hw[::-1], interpolation=cv2.INTER_CUBIC), np.uint8)


def label(tracks: list[Track], frames: list[Frame]) -> Labels:
    """Interpolate the tracks, as of a scene that does not move."""
    options = PropagationOptions(method=Method.LINEAR)
    still = Survey(np.zeros((len(frames), 2)))
    return propagate(FramesInMemory(frames), tracks, options, survey=still)


def write_page(
    folder: Path, walk: ForwardWalk, labels: Labels, frames: Iterator[Frame]
) -> VideoRow:
    """Write the page of a video, and return its row of the index."""
    folder.mkdir(parents=True)
    size_hw = (walk.info.height, walk.info.width)
    reviews = {each.track.id: suggest(each, size_hw) for each in labels.tracks}
    with ReportSink(
        folder / PAGE,
        video_id=folder.name,
        walk=walk,
        labels=labels,
        suggestions=[each for review in reviews.values() for each in review],
        files=FILES,
    ) as sink:
        for frame, points in zip(frames, labels, strict=True):
            sink.write(frame, points)
    rows = []
    for each in labels.tracks:
        samples = samples_of(each, labels.frame_count)
        review = reviews[each.track.id]
        rows.append(track_row(each.track, samples, len(review), sum(s.gain for s in review),
                              profile(each, labels.frame_count)))  # fmt: skip
    return VideoRow(folder.name, f"{folder.name}.mp4", labels.frame_count, tuple(rows), (), FILES)


def track_row(
    track: Track, samples: Samples, suggestions: int, gain: float, profile_: str
) -> TrackRow:
    """Row of a track in the index."""
    with_box = np.flatnonzero(samples.states)
    figures = figures_of(samples)
    return TrackRow(
        id=track.id,
        label=track.label,
        first_frame=int(with_box[0]) if with_box.size else None,
        last_frame=int(with_box[-1]) if with_box.size else None,
        boxes=figures.boxes,
        drawn=figures.drawn,
        tracked=figures.tracked,
        occluded=figures.in_state[State.OCCLUDED],
        lost=figures.in_state[State.LOST],
        mean_confidence=figures.mean_confidence,
        suggestions=suggestions,
        gain=gain,
        profile=profile_,
    )


def generate(folder: Path, frame_count: int, track_count: int, seed: int) -> VideoRow:
    """Write a page of generated labels."""
    random = np.random.default_rng(seed)
    pictures = [noise(random, SIZE_HW) for _ in range(8)]
    times = tuple(round(n * 10**9 / RATE) for n in range(frame_count))
    frames = [Frame(n, times[n], pictures[n % len(pictures)]) for n in range(frame_count)]
    labels = label(generated_tracks(random, track_count, frame_count), frames)
    info = VideoInfo(Path(f"{folder.name}.mp4"), "opencv", SIZE_HW[1], SIZE_HW[0], RATE)
    return write_page(folder, ForwardWalk(info, times), labels, iter(frames))


def from_sequence(folder: Path, sequence: OtbSequence) -> VideoRow:
    """Write the page of a sequence's own boxes, every hundredth of them drawn."""
    with open_video(sequence.folder / "img") as source:
        info, frames = source.info, list(source)
    tracks = []
    for number, target in enumerate(sequence.targets, start=1):
        boxes = target.truth[: len(frames)] - (1, 1, 0, 0)
        known = [n for n in range(0, len(boxes), 100) if not np.isnan(boxes[n]).any()]
        keyframes = tuple(Keyframe(n, BoundingBox(*map(float, boxes[n]))) for n in known)
        tracks.append(Track(number, target.name, keyframes))
    walk = ForwardWalk(info, tuple(frame.pts_ns for frame in frames))
    return write_page(folder, walk, label(tracks, frames), iter(frames))


def open_pages(browser: Browser, path: Path, name: str, times: int) -> Opened:
    """Open a page some times, each in a context of its own."""
    found = []
    for _ in range(times):
        context = browser.new_context(viewport={"width": 1280, "height": 800})
        page = context.new_page()
        page.goto(path.as_uri(), wait_until="load")
        page.wait_for_function(
            "() => performance.getEntriesByName('first-contentful-paint').length"
        )
        found.append(page.evaluate(READY))
        context.close()
    median = {key: statistics.median(each[key] for each in found) / 1000 for key in found[0]}
    size = path.stat().st_size / 1e6
    return Opened(name, size, median["interactive"], median["loaded"], median["paint"])


def sort_seconds(browser: Browser, path: Path) -> float:
    """Time that sorting the index takes."""
    page = browser.new_page()
    page.goto(path.as_uri())
    milliseconds: float = page.evaluate(SORT)
    page.close()
    return milliseconds / 1000


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path))
@click.option("--videos", type=click.IntRange(min=1), default=200, show_default=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
def main(sequences: Path | None, videos: int, json_path: Path) -> None:
    """Make the pages, open them, print and write the figures."""
    chromium = os.environ.get("SITUP_CHROMIUM") or shutil.which("chromium")
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        out = Path(name)
        rows = [generate(out / f"video-{n:04}", 300, 1 + n % 8, n) for n in range(videos)]
        (out / PAGE).write_text(index_html(rows, []), encoding="utf-8")
        largest = max((out / row.id / PAGE for row in rows), key=lambda path: path.stat().st_size)
        pages = {f"index of {videos} videos": out / PAGE, "largest of their pages": largest}
        generate(out / "long", 18_000, 20, 0)
        pages["18 000 frames, 20 tracks"] = out / "long" / PAGE
        for sequence in find_sequences(sequences) if sequences else []:
            from_sequence(out / f"sequence-{sequence.name}", sequence)
            pages[sequence.name] = out / f"sequence-{sequence.name}" / PAGE
        with playwright.chromium.launch(executable_path=chromium, args=ARGUMENTS) as browser:
            opened = [open_pages(browser, path, title, 5) for title, path in pages.items()]
            sorting = sort_seconds(browser, out / PAGE)
    print("| page | MB | interactive, s | loaded, s | seen, s |\n|---|---|---|---|---|")
    for each in opened:
        print(
            f"| {each.name} | {each.megabytes:.2f} | {each.interactive_s:.2f} "
            f"| {each.loaded_s:.2f} | {each.painted_s:.2f} |"
        )
    bars = {
        "index_interactive_s": opened[0].loaded_s,
        "index_sort_s": sorting,
        "largest_page_mb": max(each.megabytes for each in opened),
    }
    print(json.dumps(bars, indent=2))
    figures = {"bars": bars, "pages": [asdict(each) for each in opened]}
    json_path.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
