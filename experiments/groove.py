"""A part with grooves: calibration on half of the rows, measurement of the other half.

Under six sequential lights, as recorded, and under four colours at once, mixed by arithmetic from
the same images.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from experiments.table_row import Row, command
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.presses import angles_deg
from tactile_core.formats.tmd import read_tmd
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import read_frames
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Gradients, HeightMap

Array = NDArray[Any]

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
ROWS = 514
WALLS = [((38, 66), (80, 112), 18), ((250, 275), (312, 335), 9), ((470, 486), (488, 502), 4)]
"""For each groove: columns of its falling and rising wall, and distance of its shoulders, px."""
MARGIN_PX = 4
"""Border that is not scored, px."""

IMAGE = {"width_px": 616, "height_px": 514, "mm_per_px": 0.0274581}
SIDES = {"red": (1,), "green": (2, 3), "blue": (4,), "white": (5, 6)}
"""Images of the scan under the lights at the top, right, bottom and left."""
COLOUR, WHITE = 0.6, 0.4
"""Shares of its colour and of white in a channel, as in ``four_colour/ball_grid``."""


def rows(data: Path) -> list[Row]:
    """Calibrate on one half of the rows of a scan, and measure the other half."""
    scan = data / "six_led" / "groove"
    return [
        _row(
            "groove",
            "six_led/groove: six sequential lights",
            load_profile(EXAMPLES / "groove.yaml"),
            scan,
            scan / "heightmap.tmd",
        )
    ]


def four_colour_rows(data: Path) -> list[Row]:
    """Do the same with one image of four colours, mixed from the images of the scan."""
    scan = data / "six_led" / "groove"
    with TemporaryDirectory() as folder:
        image = Path(folder) / "groove.png"
        cv2.imwrite(str(image), mixed(scan))
        return [
            _row(
                "four_colour_groove",
                "six_led/groove, mixed into four colours at once",
                load_profile(EXAMPLES / "four_colour.yaml", overrides={"image": IMAGE}),
                image,
                scan / "heightmap.tmd",
            )
        ]


def mixed(scan: Path) -> Array:
    """Return the image (H, W, 3) uint8, blue first, that four colours would give at once."""
    images = {
        side: np.mean([cv2.imread(str(scan / f"image{i:02d}.png"), 0) for i in numbers], axis=0)
        for side, numbers in SIDES.items()
    }
    channels = [
        COLOUR * images[colour] + WHITE * images["white"] for colour in ("blue", "green", "red")
    ]
    return np.rint(np.stack(channels, axis=2)).astype(np.uint8)


def _row(name: str, recordings: str, profile: Profile, scan: Path, height_map: Path) -> Row:
    halves = {
        "upper → lower": (slice(0, ROWS // 2), slice(ROWS // 2, ROWS)),
        "lower → upper": (slice(ROWS // 2, ROWS), slice(0, ROWS // 2)),
    }
    off, errors, flat = {}, {}, {}
    depth_mm: dict[str, float] = {}
    for way, (seen, unseen) in halves.items():
        made = calibrate(profile, scan, target=height_map, rows=seen, scored=False)
        (frame,) = read_frames(profile, scan)
        reading = Pipeline(profile, made.bundle).process(frame)
        true = read_tmd(height_map).height_mm.astype(np.float64)[unseen]
        measured = depths_mm(reading[HeightMap].mm.astype(np.float64)[unseen], true)
        maker = depths_mm(true, true)
        off[way] = float(100 * np.abs(measured / maker - 1).max())
        depth_mm |= {
            f"depth of groove {i + 1}, mm, {way}": float(d) for i, d in enumerate(measured)
        }
        errors[way], flat[way] = _normals_deg(reading[Gradients], true, unseen)
    depth_mm |= {f"maker's depth of groove {i + 1}, mm": float(d) for i, d in enumerate(maker)}
    return Row(
        name,
        "depth of the worst of three grooves against the maker's map, %",
        f"{recordings}; there is no reference image, so the scan's own large-scale illumination "
        f"replaces it",
        "3 grooves on one part, half of the rows against the other",
        "out of sample in the rows only: other rows of the same scan",
        off,
        max(off.values()),
        {"predict flat": 100.0},
        command(name),
        {f"normals, degrees, {way}": error for way, error in errors.items()}
        | {f"normals of predict flat, degrees, {way}": error for way, error in flat.items()}
        | depth_mm,
    )


def depths_mm(height: Array, truth: Array) -> Array:
    """Depth of each groove, mm: median over rows of shoulders minus floor."""
    gx = np.gradient(cv2.GaussianBlur(truth, (0, 0), 1), axis=1)
    depths = []
    for (l0, l1), (r0, r1), far in WALLS:
        row_depths = []
        for row, slope in zip(height, gx, strict=True):
            left, right = l0 + np.argmin(slope[l0:l1]), r0 + np.argmax(slope[r0:r1])
            middle = (left + right) // 2
            near = [row[c - 1 : c + 2].mean() for c in (left - far, right + far, middle)]
            row_depths.append((near[0] + near[1]) / 2 - near[2])
        depths.append(np.median(row_depths))
    return np.array(depths)


def _normals_deg(measured: Gradients, truth: Array, rows: slice) -> tuple[float, float]:
    gy, gx = np.gradient(truth, measured.mm_per_px)
    true = np.stack([gx - np.median(gx), gy - np.median(gy)], axis=2)
    slopes = np.stack([measured.x[rows], measured.y[rows]], axis=2)
    inside = slice(MARGIN_PX, -MARGIN_PX), slice(MARGIN_PX, -MARGIN_PX)
    a, b = (field[inside].reshape(-1, 2) for field in (slopes, true))
    return float(angles_deg(a, b).mean()), float(angles_deg(np.zeros_like(b), b).mean())
