import csv
import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import pytest

from situp_annotate.tracking import SitupTracker, TrackerParams
from situp_annotate.types import BoundingBox, Image

SAMPLES = Path(__file__).parents[1] / "samples"
VAN, AIRSHIP = 1, 2


@pytest.fixture(scope="module")
def pictures() -> list[Image]:
    return decode(SAMPLES / "clip.mp4")


@pytest.fixture(scope="module")
def rendered(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("samples")
    command = [sys.executable, "-B", str(SAMPLES / "generate.py"), "--output", str(folder)]
    subprocess.run(command, check=True, timeout=240)
    return folder


def decode(path: Path) -> list[Image]:
    with av.open(str(path)) as container:
        frames = container.decode(video=0)
        return [np.asarray(frame.to_ndarray(format="bgr24"), np.uint8) for frame in frames]


def ground_truth(track_id: int) -> list[dict[str, float]]:
    with (SAMPLES / "ground_truth.csv").open(encoding="utf-8", newline="") as file:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    return [row for row in rows if row["id"] == track_id]


def box_of(row: dict[str, float]) -> BoundingBox:
    return BoundingBox(row["x"], row["y"], row["width"], row["height"])


def overlap(a: BoundingBox, b: BoundingBox) -> float:
    width = max(0.0, min(a.right, b.right) - max(a.x, b.x))
    height = max(0.0, min(a.bottom, b.bottom) - max(a.y, b.y))
    common = width * height
    return common / (a.width * a.height + b.width * b.height - common)


def mean_overlap(pictures: list[Image], track_id: int, params: TrackerParams) -> float:
    truth = [box_of(row) for row in ground_truth(track_id)]
    tracker = SitupTracker(params)
    tracker.init(pictures[0], truth[0])
    boxes = [tracker.update(picture).box for picture in pictures[1:]]
    return float(np.mean([overlap(*pair) for pair in zip(boxes, truth[1:], strict=True)]))


@pytest.mark.parametrize("name", ["ground_truth.csv", "manifest.json", "cvat.xml"])
def test_the_generator_writes_the_committed_truth_and_boxes(rendered: Path, name: str) -> None:
    assert (rendered / name).read_bytes() == (SAMPLES / name).read_bytes()


def test_the_generator_renders_the_committed_pictures(
    rendered: Path, pictures: list[Image]
) -> None:
    # Not byte for byte: another x264 or OpenCV may round differently.
    again = decode(rendered / "clip.mp4")
    assert len(again) == len(pictures)
    for index, (new, old) in enumerate(zip(again, pictures, strict=True)):
        error = np.mean((new.astype(np.float32) - old) ** 2)
        psnr_db = 10 * np.log10(255**2 / max(error, 1e-6))
        assert psnr_db > 35, f"frame {index}: {psnr_db:.1f} dB"


def test_the_clip_is_small_and_as_documented(pictures: list[Image]) -> None:
    assert sum(file.stat().st_size for file in SAMPLES.iterdir() if file.is_file()) < 1_000_000
    assert len(pictures) == 240
    assert {picture.shape for picture in pictures} == {(360, 640, 3)}


@pytest.mark.parametrize("track_id", [VAN, AIRSHIP])
def test_the_truth_doubles_in_size_and_shrinks_again(track_id: int) -> None:
    rows = ground_truth(track_id)
    assert [row["frame"] for row in rows] == list(range(240))
    widths = np.array([row["width"] for row in rows])
    assert widths.max() / widths[0] == pytest.approx(2, abs=0.001)
    assert widths[-1] == widths[0]
    assert np.abs(np.diff(np.log(widths))).max() < 0.01
    assert all(0 <= row["visibility"] <= 1 for row in rows)


def test_the_tower_hides_the_van_and_lets_it_go() -> None:
    visibility = [row["visibility"] for row in ground_truth(VAN)]
    assert min(visibility) < 0.3
    assert visibility[0] == visibility[-1] == 1


def test_the_truth_of_the_last_frame_bounds_the_red_of_the_van(pictures: list[Image]) -> None:
    # The van's red skirt is as wide as its box; nothing else is red on that part of the road.
    box = box_of(ground_truth(VAN)[-1])
    top, left = 180, 450
    blue, green, red = np.moveaxis(pictures[-1][top:240, left:].astype(int), 2, 0)
    rows, columns = np.nonzero((red > 130) & (green < 90) & (blue < 80))
    assert columns.min() + left == pytest.approx(box.x, abs=1.5)
    assert columns.max() + 1 + left == pytest.approx(box.right, abs=1.5)
    assert box.y < rows.min() + top < rows.max() + top < box.bottom


@pytest.mark.parametrize("track_id", [VAN, AIRSHIP])
def test_the_clip_needs_the_search_for_scale(pictures: list[Image], track_id: int) -> None:
    pool = mean_overlap(pictures, track_id, TrackerParams())
    one_scale = mean_overlap(pictures, track_id, TrackerParams(scale_factors=(1.0,)))
    assert pool >= 0.7
    assert one_scale <= 0.6
