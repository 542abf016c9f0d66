"""What stands in the sample clip: a valley, a tower, a camper van, an airship; all drawn by code.

Colours are red, green, blue in [0, 1]. Places are in *world pixels*: those of the picture of a
camera that stands still; (0, 0) is the top-left corner of its top-left pixel.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

WIDTH, HEIGHT = 640, 360
"""Size of the picture."""
HORIZON = 172
"""Row of the horizon."""
EYE_LEVEL = 64
"""What stands on the ground and looks n times its smallest size is n · EYE_LEVEL below it."""
PLATE_MARGIN = 40
"""World pixels drawn around the picture, for the camera to move over."""
PLATE_DETAIL = 2
"""Pixels of the background plate per world pixel."""

Picture = npt.NDArray[np.float32]
"""float32 in [0, 1]: (height, width, 3), or with a fourth channel: alpha, premultiplied."""
Colour = tuple[float, float, float]
Points = Sequence[tuple[float, float]]
"""Corners of a polygon: x, y."""


@dataclass(frozen=True, slots=True)
class Box:
    """An upright rectangle."""

    x: float
    y: float
    width: float
    height: float


TOWER = Box(150, 82, 50, 244)
"""The tower hides exactly this rectangle of the world."""


def fractal_noise(
    rng: np.random.Generator, size_hw: tuple[int, int], grain_hw: tuple[int, int], octaves: int
) -> Picture:
    """Noise of mean 0 and deviation 1, (height, width), whose largest features are one grain."""
    total: Picture = np.zeros(size_hw, np.float32)
    for octave in range(octaves):
        coarse_hw = [
            max(2, round(size * 2**octave / grain))
            for size, grain in zip(size_hw, grain_hw, strict=True)
        ]
        coarse = rng.standard_normal(coarse_hw, dtype=np.float32)
        fine = cv2.resize(coarse, size_hw[::-1], interpolation=cv2.INTER_CUBIC)
        total += np.asarray(fine, np.float32) / 1.7**octave
    return np.asarray((total - total.mean()) / total.std(), np.float32)


def polygon(picture: Picture, points: Points, colour: Colour) -> None:
    """Fill a polygon."""
    cv2.fillPoly(picture, [np.rint(points).astype(np.int32)], (*colour, 1.0))


def rectangle(picture: Picture, x: float, y: float, right: float, bottom: float, c: Colour) -> None:
    """Fill an upright rectangle."""
    polygon(picture, [(x, y), (right, y), (right, bottom), (x, bottom)], c)


def disc(picture: Picture, x: float, y: float, radius: float, colour: Colour) -> None:
    """Fill a circle."""
    cv2.circle(picture, (round(x), round(y)), round(radius), (*colour, 1.0), -1)


def halved(texture: Picture) -> Picture:
    """Shrink a texture to half its size, which smooths the edges of what was drawn."""
    return np.asarray(cv2.resize(texture, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA))


# Things: pictures with alpha that touch all four of their edges ---------------------------------


def van_texture() -> Picture:
    """Draw a red and cream camper van from its right side."""
    van = np.zeros((432, 672, 4), np.float32)
    outline = [(0, 70), (30, 14), (70, 0), (540, 0), (590, 20), (671, 200), (671, 372), (0, 372)]
    polygon(van, outline, (0.97, 0.91, 0.76))
    skirt = [(0, 205), (440, 205), (520, 250), (671, 215), (671, 372), (0, 372)]
    polygon(van, skirt, (0.80, 0.16, 0.12))
    for x in (36, 172, 308):
        rectangle(van, x, 50, x + 114, 160, (0.22, 0.36, 0.45))
        reflection = [(x, 160), (x + 50, 50), (x + 80, 50), (x + 30, 160)]
        polygon(van, reflection, (0.55, 0.72, 0.80))
    polygon(van, [(450, 50), (552, 50), (608, 165), (450, 165)], (0.22, 0.36, 0.45))
    for x in range(0, 420, 84):
        diamond = [(x, 275), (x + 42, 235), (x + 84, 275), (x + 42, 315)]
        polygon(van, diamond, (0.98, 0.75, 0.18))
    rectangle(van, 0, 352, 671, 380, (0.30, 0.30, 0.32))
    disc(van, 640, 268, 24, (1.0, 0.97, 0.70))
    for x in (140, 530):
        disc(van, x, 362, 69, (0.10, 0.10, 0.11))
        disc(van, x, 362, 36, (0.82, 0.82, 0.84))
        disc(van, x, 362, 16, (0.45, 0.12, 0.10))
    return halved(van)


def airship_texture() -> Picture:
    """Draw an airship that flies to the left: patchwork hull, gondola, fins."""
    ship = np.zeros((432, 672, 4), np.float32)
    rectangle(ship, 210, 360, 222, 390, (0.25, 0.22, 0.20))
    rectangle(ship, 370, 360, 382, 390, (0.25, 0.22, 0.20))
    polygon(ship, [(180, 385), (410, 385), (385, 431), (215, 431)], (0.45, 0.26, 0.13))
    for x in (225, 280, 335):
        rectangle(ship, x, 392, x + 38, 412, (0.95, 0.92, 0.75))
    for tip, root in ((20, 110), (360, 270)):
        polygon(ship, [(671, tip), (590, tip), (480, root), (590, 190)], (0.80, 0.18, 0.14))
    v, u = np.mgrid[0:432, 0:672] + 0.5
    across = (v - 190) / (190 * np.sqrt(np.clip(1 - ((u - 315) / 315) ** 2, 1e-6, 1)))
    hull = np.abs(across) < 1
    latitude = np.arcsin(np.clip(across, -1, 1)) / math.pi + 0.5
    colours = [(0.95, 0.77, 0.16), (0.13, 0.36, 0.62), (0.98, 0.94, 0.85), (0.88, 0.30, 0.16)]
    patch = np.floor(u / 105) + 2 * np.floor(latitude * 4)
    colour = np.array(colours)[patch.astype(int) % 4]
    light = 0.88 - 0.30 * across - 0.10 * u / 672
    ship[hull, :3] = np.clip(colour * light[..., None], 0, 1)[hull]
    ship[hull, 3] = 1
    polygon(ship, [(671, 165), (671, 215), (500, 198), (500, 182)], (0.80, 0.18, 0.14))
    return halved(ship)


def tower_texture(rng: np.random.Generator) -> Picture:
    """Draw a brick tower with a clock and windows, lit from the left."""
    width, height = round(TOWER.width) * 5, round(TOWER.height) * 5
    tower = np.ones((height, width, 4), np.float32)
    tower[..., :3] = (0.66, 0.60, 0.52)
    for row, y in enumerate(range(0, height, 28)):
        for x in range(-26 * (row % 2), width, 52):
            shade = rng.uniform(0.72, 1.1)
            brick = (0.62 * shade, 0.33 * shade, 0.24 * shade)
            rectangle(tower, x + 3, y + 3, x + 49, y + 25, brick)
    stone, dark = (0.82, 0.76, 0.66), (0.15, 0.15, 0.18)
    rectangle(tower, 0, 0, width, 40, (0.42, 0.36, 0.31))
    for x in range(-13, width, 57):
        rectangle(tower, x, 0, x + 30, 40, stone)
    for y in (40, 250, height - 60):
        rectangle(tower, 0, y, width, y + 24, stone)
    middle = width // 2
    disc(tower, middle, 156, 80, (0.30, 0.24, 0.20))
    disc(tower, middle, 156, 68, (0.96, 0.94, 0.86))
    for x, y in ((middle, 104), (middle + 38, 174)):
        cv2.line(tower, (middle, 156), (x, y), (*dark, 1.0), 11)
    for y in (390, 640, 890):
        rectangle(tower, middle - 34, y, middle + 34, y + 110, dark)
        disc(tower, middle, y, 34, dark)
    light = 1.12 - 0.55 * np.linspace(0, 1, width, dtype=np.float32) ** 1.5
    grain = 1 + 0.05 * fractal_noise(rng, (height, width), (40, 40), 3)
    tower[..., :3] = np.clip(tower[..., :3] * (light * grain)[..., None], 0, 1)
    return halved(tower)


def shadow_texture() -> Picture:
    """Draw a soft dark spot for the ground under the van."""
    v, u = np.mgrid[-1:1:40j, -1:1:160j]
    shadow = np.zeros((40, 160, 4), np.float32)
    shadow[..., 3] = 0.65 * np.clip(1 - u**2 - v**2, 0, 1) ** 0.6
    return shadow


# The plate that the camera moves over -----------------------------------------------------------


def plate_xy(x: float, y: float) -> tuple[float, float]:
    """Pixel of the plate at a place of the world."""
    return (x + PLATE_MARGIN) * PLATE_DETAIL, (y + PLATE_MARGIN) * PLATE_DETAIL


def landscape(rng: np.random.Generator, road_size: Callable[[float], float]) -> Picture:
    """Draw sky, hills, wood, meadow and road.

    Parameters
    ----------
    rng : numpy.random.Generator
        Where clouds, hills, trees and flowers come from.
    road_size : callable
        Size at which things on the road appear at a column of the world; gives its course.
    """
    size_hw = (HEIGHT + 2 * PLATE_MARGIN) * PLATE_DETAIL, (WIDTH + 2 * PLATE_MARGIN) * PLATE_DETAIL
    y = (np.arange(size_hw[0]) / PLATE_DETAIL - PLATE_MARGIN)[:, None, None]
    height = np.clip(y / HORIZON, 0, 1)
    sky = (1 - height) * (0.28, 0.50, 0.82) + height * (0.88, 0.91, 0.93)
    cloud = np.clip(fractal_noise(rng, size_hw, (120, 400), 5) * 0.5, 0, 0.9)[..., None]
    plate = sky * (1 - cloud) + np.multiply(cloud, (0.98, 0.97, 0.96))

    layers: list[tuple[float, float, float, Colour]] = [
        (HORIZON - 44, 13, 0.05, (0.57, 0.66, 0.77)),
        (HORIZON - 22, 9, 0.07, (0.40, 0.53, 0.55)),
        (HORIZON - 8, 4, 0.11, (0.28, 0.43, 0.30)),
        (HORIZON, 0.5, 0.15, (0.45, 0.60, 0.25)),
    ]
    for top, relief, contrast, colour in layers:
        ridge = top + relief * fractal_noise(rng, (2, size_hw[1]), (2, 330), 7)[0]
        grain = fractal_noise(rng, size_hw, (24, 70), 6)[..., None]
        below = y[..., 0] > ridge
        plate[below] = (np.multiply(1 + contrast * grain, colour))[below]
    depth = np.clip((y - HORIZON) / (HEIGHT - HORIZON), 0, 1)
    plate *= 1 - depth * (0.45, 0.28, 0.35)

    picture = np.asarray(plate, np.float32)
    draw_wood(picture, rng)
    draw_road(picture, rng, road_size)
    draw_flowers(picture, rng, road_size)
    foot = plate_xy(TOWER.x + 0.62 * TOWER.width, TOWER.y + TOWER.height - 2)
    shade = np.zeros(size_hw, np.float32)
    cv2.ellipse(shade, np.rint(foot).astype(int).tolist(), (80, 14), 0, 0, 360, 0.6, -1)
    picture *= 1 - cv2.GaussianBlur(shade, (0, 0), 5)[..., None]
    return np.asarray(cv2.GaussianBlur(picture.clip(0, 1), (0, 0), 0.7))


def draw_wood(plate: Picture, rng: np.random.Generator) -> None:
    """Draw the edge of a wood along the horizon, the far trees first."""
    for nearness in np.linspace(0, 1, 420):
        x, y = plate_xy(rng.uniform(-PLATE_MARGIN, WIDTH + PLATE_MARGIN), HORIZON + 5 * nearness)
        radii = round(rng.uniform(5, 11)), round(rng.uniform(6, 14))
        shade = rng.uniform(0.6, 1.2)
        leaves = (0.17 * shade, 0.30 * shade, 0.14 * shade)
        cv2.ellipse(plate, (round(x), round(y)), radii, 0, 0, 360, leaves, -1)


def draw_road(
    plate: Picture, rng: np.random.Generator, road_size: Callable[[float], float]
) -> None:
    """Draw a road with dashes along its middle, as wide as perspective makes it."""
    columns = np.arange(-PLATE_MARGIN, WIDTH + PLATE_MARGIN + 1, 4.0)

    def strip(near: float, far: float, xs: npt.NDArray[np.float64] = columns) -> Points:
        edge = [(x, HORIZON + near * road_size(x)) for x in xs]
        back = [(x, HORIZON + far * road_size(x)) for x in xs[::-1]]
        return [plate_xy(x, y) for x, y in edge + back]

    polygon(plate, strip(EYE_LEVEL + 13, EYE_LEVEL - 12), (0.56, 0.52, 0.40))
    asphalt = np.zeros_like(plate)
    polygon(asphalt, strip(EYE_LEVEL + 11, EYE_LEVEL - 10), (0.46, 0.45, 0.44))
    for start in range(0, len(columns) - 4, 8):
        dash = strip(EYE_LEVEL + 7.2, EYE_LEVEL + 6.2, columns[start : start + 4])
        polygon(asphalt, dash, (0.92, 0.90, 0.80))
    asphalt *= 1 + 0.10 * fractal_noise(rng, plate.shape[:2], (12, 60), 4)[..., None]
    np.copyto(plate, asphalt, where=asphalt.any(axis=2, keepdims=True))


def draw_flowers(
    plate: Picture, rng: np.random.Generator, road_size: Callable[[float], float]
) -> None:
    """Scatter flowers over the meadow, the far and small ones first."""
    petals = [(0.96, 0.92, 0.85), (0.95, 0.80, 0.25), (0.85, 0.30, 0.28)]
    for nearness in np.linspace(0.1, 1.2, 900):
        x = rng.uniform(-PLATE_MARGIN, WIDTH + PLATE_MARGIN)
        y = HORIZON + nearness * (HEIGHT - HORIZON)
        colour = petals[rng.integers(len(petals))]
        if abs(y - HORIZON - EYE_LEVEL * road_size(x)) > 15 * road_size(x):
            disc(plate, *plate_xy(x, y), 1 + 2 * nearness, colour)
