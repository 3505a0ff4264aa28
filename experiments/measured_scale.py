"""Scales measured in rendered images, and in recordings of gels with markers.

``python experiments/measured_scale.py [DATA]`` prints the error of the mean scale of printed grids
(three patterns, rotated and in perspective, with noise), that of two balls and of two calliper tips
that are pressed on a virtual sensor, and, with a folder of recordings, the marker gels' scales
along x and y next to the published one.
"""

from __future__ import annotations

import itertools
import math
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.light.sequence import imprint_distance
from tactile_core.algorithms.markers.grid_pitch import measure_pitch
from tactile_sim.stage import VirtualStage

Image = NDArray[np.generic]

# Where there is ink, given the coordinates in cells of the pattern.
_INK: dict[str, Callable[[Image, Image], NDArray[np.bool_]]] = {
    "lines": lambda u, v: (_within(u) < 0.2) | (_within(v) < 0.2),
    "checks": lambda u, v: (np.floor(u) + np.floor(v)) % 2 == 0,
    "dots": lambda u, v: (_within(u) - 0.5) ** 2 + (_within(v) - 0.5) ** 2 < 0.28**2,
}
PATTERNS = tuple(_INK)
PITCHES_PX, ROTATIONS_DEG, TAPERS, SEEDS = (8.0, 15.0, 27.0, 40.0), (0, 5, 10), (0.0, 0.1), range(5)
_FINER = 4
"""Sub-pixels per pixel."""


def _within(coordinate: Image) -> Image:
    """Return the place within a cell, faster than ``coordinate % 1``."""
    return coordinate - np.floor(coordinate)


def grid(
    pattern: str, pitch_px: float, rotation_deg: float, taper: float, seed: int, aspect: float = 1
) -> NDArray[np.uint8]:
    """Photograph a printed grid, (240, 320), under uneven light.

    ``taper`` is the change of the scale from the centre to the left or right border, in a direction
    that the seed chooses; ``aspect`` is the height of a pixel over its width.
    """
    random = np.random.default_rng(seed)
    height, width = 240, 320
    rows, columns = (
        (fine.astype(np.float32) + 0.5) / _FINER - 0.5
        for fine in np.ogrid[: height * _FINER, : width * _FINER]
    )
    x, y = columns - (width - 1) / 2, (rows - (height - 1) / 2) * aspect
    towards = random.uniform(0, 2 * np.pi)
    per_cell = 1 + 2 * taper / width * (math.cos(towards) * x + math.sin(towards) * y)
    per_cell *= pitch_px
    turn, (u0, v0) = math.radians(rotation_deg), random.uniform(0, 1, 2).tolist()
    u = (math.cos(turn) * x + math.sin(turn) * y) / per_cell + u0
    v = (math.cos(turn) * y - math.sin(turn) * x) / per_cell + v0
    printed = np.where(_INK[pattern](u, v), np.float32(60), np.float32(180))
    printed = cv2.GaussianBlur(printed, (0, 0), 0.8 * _FINER)
    image = cv2.resize(printed, (width, height), interpolation=cv2.INTER_AREA).astype(np.float64)
    row, column = np.mgrid[:height, :width]
    image *= 1 - 0.5 * ((column / width - 0.6) ** 2 + (row / height - 0.4) ** 2)
    return np.clip(image + random.normal(0, 6, image.shape), 0, 255).astype(np.uint8)


def grid_errors(pattern: str, seeds: Iterable[int] = SEEDS) -> Iterator[float]:
    """Relative error of the mean scale of each image of a pattern; infinite if none was found."""
    for pitch, turn, taper, seed in itertools.product(PITCHES_PX, ROTATIONS_DEG, TAPERS, seeds):
        found = measure_pitch(grid(pattern, pitch, turn, taper, seed))
        scales = np.inf if found is None else np.array([pitch / found.x_px, pitch / found.y_px])
        yield abs(float(np.mean(scales)) - 1)


def pair(kind: str, apart_mm: float, seed: int) -> tuple[Image, Image, float]:
    """Press two balls or two tips on a virtual sensor; the image, the undeformed one, mm per px."""
    stage = VirtualStage("hex_fingertip_unmarked", seed=seed)
    undeformed = stage.frame().pixels
    fine_mm = 0.02
    y, x = np.mgrid[-4:4:400j, -7:7:700j]
    beside = np.abs(x) - apart_mm / 2
    if kind == "balls":
        relief = np.sqrt(np.maximum(1.5**2 - beside**2 - y**2, 0))
    else:
        relief = np.where((np.abs(beside) < 0.3) & (np.abs(y) < 2), 1.5, 0.0)
    random = np.random.default_rng(seed)
    stage.indenter(
        "heightmap", height_mm=relief, mm_per_px=fine_mm, angle_deg=float(random.uniform(0, 40))
    )
    stage.press(depth_mm=float(random.uniform(0.3, 0.7)))
    return stage.frame().pixels, undeformed, stage.profile.image.mm_per_px


def pair_errors(kind: str) -> Iterator[float]:
    """Relative error of the scale of each press; infinite if no pair was found."""
    for seed in SEEDS:
        image, undeformed, mm_per_px = pair(kind, 6.0, seed)
        found = imprint_distance(image, undeformed)
        yield np.inf if found is None else abs(6.0 / float(np.hypot(*found)) / mm_per_px - 1)


def marked_gels(data: Path) -> Iterator[tuple[str, Image, float, float]]:
    """Name, image, published pitch in mm and published mm per px of each gel with markers."""
    corners = np.array([[33, 58], [208, 61], [56, 250], [185, 244]], np.float32)
    full = np.array([[0, 0], [240, 0], [0, 320], [240, 320]], np.float32)
    rectified = cv2.getPerspectiveTransform(corners, full)
    yield "hex_fingertip", _read(data / "three_colour/hex_fingertip/frame0.jpg"), 1.71, 0.03026
    for name in ("wedge/bg-0.jpg", "wedge_2/background.jpg"):
        wedge = _read(data / "three_colour" / name)
        yield name, cv2.warpPerspective(wedge, rectified, (240, 320)), 1.96, 0.1


def _read(path: Path) -> Image:
    image = cv2.imread(str(path))
    assert image is not None, path
    return image


def main(data: Path | None) -> None:
    """Print a line for each pattern, pair and gel."""
    measured = {name: list(grid_errors(name)) for name in PATTERNS}
    measured |= {kind: list(pair_errors(kind)) for kind in ("balls", "tips")}
    for name, errors in measured.items():
        off = np.array(errors)
        print(f"{name}: {len(off)} images, median {np.median(off):.2%}, worst {off.max():.2%}")
    for name, image, pitch_mm, published in () if data is None else marked_gels(data):
        found = measure_pitch(image)
        assert found is not None, name
        x_mm, y_mm = pitch_mm / found.x_px, pitch_mm / found.y_px
        print(
            f"{name}: {x_mm:.5f} along x, {y_mm:.5f} along y, ± {found.error:.1%}; mean "
            f"{(x_mm + y_mm) / 2 / published - 1:+.1%} from the published {published:g}"
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
