"""Render the sample clip, its ground truth, its manifest, and the same boxes as CVAT has them.

    python samples/generate.py [--output FOLDER]

A camper van drives along a valley road and an airship flies over it. Both grow to twice their
size and shrink again; a tower hides three quarters of the van and half of the airship. The camera
pans and trembles, its shutter blurs what moves, its sensor adds noise.

Nothing is read, all is drawn from one seed: the same versions of numpy, OpenCV and PyAV write the
same bytes. All but the clip needs arithmetic only and is the same everywhere.
"""

import argparse
import csv
import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import av
import cv2
import numpy as np
import numpy.typing as npt
import scenery
from scenery import EYE_LEVEL, HEIGHT, HORIZON, TOWER, WIDTH, Box, Picture

FRAME_COUNT, FRAME_RATE = 240, 30
LAST = FRAME_COUNT - 1
SEED = 2024
VAN_START, VAN_WAY = 84, 490
"""World pixels."""

SHUTTER = (-0.2, 0.2)
"""Instants that a frame averages, in frames. The ground truth holds in the middle."""
DEFOCUS_SIGMA = 0.6
"""Pixels."""
NOISE_SIGMA = 3.0
"""Grey levels of 255."""


# Where things are at time t, in frames ---------------------------------------------------------


def camera_xy(t: float) -> tuple[float, float]:
    """Return the camera's place: a slow pan and the tremble of a hand."""
    pan = 24 * math.sin(math.pi * (t / LAST - 0.5))
    x = pan + 0.9 * math.sin(0.31 * t) + 0.5 * math.sin(0.83 * t + 1)
    y = 2.5 * math.sin(0.024 * t) + 0.7 * math.sin(0.37 * t + 2) + 0.4 * math.sin(0.71 * t)
    return x, y


def size_at(t: float) -> float:
    """Return size over first size: 1 in the first and last frame, 2 midway; under 1 % a frame."""
    return math.exp2(math.sin(math.pi * t / LAST) ** 2)


def van_x(t: float) -> float:
    """Return the column of the world where the van's middle is; it brakes to a halt."""
    return VAN_START + VAN_WAY * (1 - (1 - t / LAST) ** 2)


def road_size(x: float) -> float:
    """Return the size of what is on the road at a column of the world: the van's when there."""
    way_left = min(max(1 - (x - VAN_START) / VAN_WAY, 0), 1)
    return size_at(LAST * (1 - math.sqrt(way_left)))


def van_box(t: float) -> Box:
    """Return the van's box in the world; its wheels touch the road."""
    size = size_at(t)
    width, height = 64 * size, 41 * size
    return Box(van_x(t) - width / 2, HORIZON + EYE_LEVEL * size - height, width, height)


def airship_box(t: float) -> Box:
    """Return the airship's box in the world: it flies against the van's way, and bobs."""
    size = size_at(t)
    width, height = 70 * size, 45 * size
    middle_x, middle_y = 560 - 1.9 * t, 90 + 10 * math.sin(0.04 * t)
    return Box(middle_x - width / 2, middle_y - height / 2, width, height)


def visible_share(box: Box) -> float:
    """Return the share of a box of the world that the tower does not hide."""
    overlap_x = min(box.x + box.width, TOWER.x + TOWER.width) - max(box.x, TOWER.x)
    overlap_y = min(box.y + box.height, TOWER.y + TOWER.height) - max(box.y, TOWER.y)
    return 1 - max(overlap_x, 0) * max(overlap_y, 0) / (box.width * box.height)


def in_picture(box: Box, t: float) -> Box:
    """Return the box in the picture, in pixels, of a box of the world."""
    x, y = camera_xy(t)
    return Box(box.x - x, box.y - y, box.width, box.height)


# The camera ------------------------------------------------------------------------------------


def placement(box: Box, size_hw: tuple[int, int]) -> npt.NDArray[np.float64]:
    """Return the affine map for cv2.warpAffine that stretches a texture over a box."""
    step_x, step_y = box.width / size_hw[1], box.height / size_hw[0]
    # Pixel i has its centre at i + 0.5; warpAffine counts from centre to centre.
    return np.array(
        [
            [step_x, 0, box.x + step_x / 2 - 0.5],
            [0, step_y, box.y + step_y / 2 - 0.5],
        ]
    )


def paste(picture: Picture, texture: Picture, box: Box) -> None:
    """Lay a texture over the picture so that it fills the box, to a fraction of a pixel."""
    left, top = math.floor(box.x) - 1, math.floor(box.y) - 1
    width, height = math.ceil(box.width) + 3, math.ceil(box.height) + 3
    # Shrunk by averages to twice the size, set in place there, averaged again: no step skips
    # pixels of the texture, so nothing flickers.
    double = Box(2 * (box.x - left), 2 * (box.y - top), 2 * box.width, 2 * box.height)
    small_hw = round(double.height), round(double.width)
    small = cv2.resize(texture, small_hw[::-1], interpolation=cv2.INTER_AREA)
    placed = cv2.warpAffine(small, placement(double, small_hw), (2 * width, 2 * height))
    layer = cv2.resize(placed, (width, height), interpolation=cv2.INTER_AREA)

    first_row, first_column = max(top, 0), max(left, 0)
    under = picture[first_row : top + height, first_column : left + width]
    layer = layer[first_row - top :, first_column - left :][: under.shape[0], : under.shape[1]]
    under *= 1 - layer[..., 3:]
    under += layer[..., :3]


def render() -> Iterator[npt.NDArray[np.uint8]]:
    """Yield the frames: uint8, (HEIGHT, WIDTH, 3), red, green, blue."""
    rng = np.random.default_rng(SEED)
    plate, tower = scenery.landscape(rng, road_size), scenery.tower_texture(rng)
    van, airship = scenery.van_texture(), scenery.airship_texture()
    shadow = scenery.shadow_texture()
    margin = scenery.PLATE_MARGIN
    world = Box(-margin, -margin, WIDTH + 2 * margin, HEIGHT + 2 * margin)

    def instant(t: float) -> Picture:
        affine = placement(in_picture(world, t), plate.shape[:2])
        picture = np.asarray(cv2.warpAffine(plate, affine, (WIDTH, HEIGHT)), np.float32)
        body = in_picture(van_box(t), t)
        ground = Box(body.x, body.y + 0.89 * body.height, 1.04 * body.width, 0.2 * body.height)
        paste(picture, airship, in_picture(airship_box(t), t))
        paste(picture, shadow, ground)
        paste(picture, van, body)
        paste(picture, tower, in_picture(TOWER, t))
        return picture

    for index in range(FRAME_COUNT):
        exposure = np.mean([instant(index + shift) for shift in SHUTTER], axis=0)
        picture = 255 * cv2.GaussianBlur(exposure, (0, 0), DEFOCUS_SIGMA)
        noise = NOISE_SIGMA * rng.standard_normal((HEIGHT, WIDTH, 1), dtype=np.float32)
        yield np.clip(np.rint(picture + noise), 0, 255).astype(np.uint8)


# Files -----------------------------------------------------------------------------------------


def write_clip(path: Path) -> None:
    """Encode the frames as H.264, on one thread: the bytes depend on the number of threads."""
    with av.open(str(path), "w", options={"movflags": "+faststart"}) as container:
        stream = container.add_stream("libx264", rate=FRAME_RATE)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        stream.thread_count = 1
        stream.options = {"preset": "veryfast", "crf": "20"}
        for picture in render():
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())


def write_ground_truth(path: Path) -> None:
    """Write the exact box of each thing in each frame, also while it is hidden."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["frame", "id", "x", "y", "width", "height", "visibility"])
        for frame in range(FRAME_COUNT):
            for track_id, world_box in enumerate((van_box(frame), airship_box(frame)), start=1):
                box = in_picture(world_box, frame)
                numbers = (box.x, box.y, box.width, box.height, visible_share(world_box))
                writer.writerow([frame, track_id, *(f"{number:.3f}" for number in numbers)])


def drawn(box: Box, frame: int) -> dict[str, Any]:
    """Make a keyframe as a person draws it: to the pixel."""
    box = in_picture(box, frame)
    return {"frame": frame, "box": [round(n) for n in (box.x, box.y, box.width, box.height)]}


def drawn_tracks() -> list[dict[str, Any]]:
    """What a person draws: one box for the airship; for the van another one, after the tower."""
    hidden = [frame for frame in range(FRAME_COUNT) if visible_share(van_box(frame)) < 1]
    van = [drawn(van_box(frame), frame) for frame in (0, hidden[-1] + 1)]
    return [
        {"id": 1, "label": "van", "keyframes": van},
        {"id": 2, "label": "airship", "keyframes": [drawn(airship_box(0), 0)]},
    ]


def write_manifest(path: Path) -> None:
    """Write the job; a single keyframe stands in its track itself."""
    tracks = []
    for track in drawn_tracks():
        if len(track["keyframes"]) == 1:
            (keyframe,) = track.pop("keyframes")
            track |= keyframe
        tracks.append(track)
    manifest = {"version": 1, "videos": [{"path": "clip.mp4", "tracks": tracks}]}
    text = json.dumps(manifest, indent=2)
    one_line_boxes = re.sub(
        r"\[\s+(\d+),\s+(\d+),\s+(\d+),\s+(\d+)\s+\]", r"[\1, \2, \3, \4]", text
    )
    path.write_text(one_line_boxes + "\n", encoding="utf-8")


def write_cvat(path: Path) -> None:
    """Write the same boxes as CVAT exports them: "CVAT for video 1.1"."""
    root = ET.Element("annotations")
    ET.SubElement(root, "version").text = "1.1"
    task = ET.SubElement(ET.SubElement(root, "meta"), "task")
    for name, text in (("name", "clip"), ("size", str(FRAME_COUNT)), ("mode", "interpolation")):
        ET.SubElement(task, name).text = text
    labels = ET.SubElement(task, "labels")
    size = ET.SubElement(task, "original_size")
    for name, pixels in (("width", WIDTH), ("height", HEIGHT)):
        ET.SubElement(size, name).text = str(pixels)
    ET.SubElement(task, "source").text = "clip.mp4"
    for number, track in enumerate(drawn_tracks()):
        ET.SubElement(ET.SubElement(labels, "label"), "name").text = track["label"]
        element = ET.SubElement(root, "track", id=str(number), label=track["label"])
        element.set("source", "manual")
        for keyframe in track["keyframes"]:
            left, top, width, height = keyframe["box"]
            corners = {"xtl": left, "ytl": top, "xbr": left + width, "ybr": top + height}
            flags = {"keyframe": 1, "outside": 0, "occluded": 0}
            words = {"frame": keyframe["frame"], **flags}
            box = ET.SubElement(element, "box", {name: str(n) for name, n in words.items()})
            for name, pixels in corners.items():
                box.set(name, f"{pixels:.2f}")
            box.set("z_order", "0")
    ET.indent(root)
    ET.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def main() -> None:
    """Write the files."""
    parser = argparse.ArgumentParser(description="Render the sample clip.")
    parser.add_argument("--output", type=Path, default=Path(__file__).parent, metavar="FOLDER")
    folder: Path = parser.parse_args().output
    write_ground_truth(folder / "ground_truth.csv")
    write_manifest(folder / "manifest.json")
    write_cvat(folder / "cvat.xml")
    write_clip(folder / "clip.mp4")


if __name__ == "__main__":
    main()
