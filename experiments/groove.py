"""A part with grooves: calibration on half of the rows, measurement of the other half."""

from __future__ import annotations

from pathlib import Path
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
from tactile_core.quantities import Gradients, HeightMap

Array = NDArray[Any]

GROOVE = Path(__file__).resolve().parents[1] / "examples" / "groove.yaml"
ROWS = 514
WALLS = [((38, 66), (80, 112), 18), ((250, 275), (312, 335), 9), ((470, 486), (488, 502), 4)]
"""For each groove: columns of its falling and rising wall, and distance of its shoulders, px."""
MARGIN_PX = 4
"""Border that is not scored, px."""


def rows(data: Path) -> list[Row]:
    """Calibrate on one half of the rows of a scan, and measure the other half."""
    scan = data / "six_led" / "groove"
    halves = {
        "upper → lower": (slice(0, ROWS // 2), slice(ROWS // 2, ROWS)),
        "lower → upper": (slice(ROWS // 2, ROWS), slice(0, ROWS // 2)),
    }
    off, errors, flat = {}, {}, {}
    depth_mm: dict[str, float] = {}
    for way, (seen, unseen) in halves.items():
        made = calibrate(GROOVE, scan, target=scan / "heightmap.tmd", rows=seen, scored=False)
        pipeline = Pipeline(GROOVE, made.bundle)
        (frame,) = read_frames(pipeline.profile, scan)
        reading = pipeline.process(frame)
        true = read_tmd(scan / "heightmap.tmd").height_mm.astype(np.float64)[unseen]
        measured = depths_mm(reading[HeightMap].mm.astype(np.float64)[unseen], true)
        maker = depths_mm(true, true)
        off[way] = float(100 * np.abs(measured / maker - 1).max())
        depth_mm |= {
            f"depth of groove {i + 1}, mm, {way}": float(d) for i, d in enumerate(measured)
        }
        errors[way], flat[way] = _normals_deg(reading[Gradients], true, unseen)
    depth_mm |= {f"maker's depth of groove {i + 1}, mm": float(d) for i, d in enumerate(maker)}
    return [
        Row(
            "groove",
            "depth of the worst of three grooves against the maker's map, %",
            "six_led/groove: six sequential lights; there is no reference image, so the scan's own "
            "large-scale illumination replaces it",
            "3 grooves on one part, half of the rows against the other",
            "out of sample in the rows only: other rows of the same scan",
            off,
            max(off.values()),
            {"predict flat": 100.0},
            command("groove"),
            {f"normals, degrees, {way}": error for way, error in errors.items()}
            | {f"normals of predict flat, degrees, {way}": error for way, error in flat.items()}
            | depth_mm,
        )
    ]


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
