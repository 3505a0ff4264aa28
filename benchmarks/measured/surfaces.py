"""Surfaces whose shape is known: a part with grooves, and an object without a calibration."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat

from measured.row import Row, command
from tactile_core.calibrating import calibrate
from tactile_core.calibrating.presses import angles_deg
from tactile_core.formats.tmd import read_tmd
from tactile_core.pipeline import Pipeline
from tactile_core.quantities import Gradients, HeightMap
from tactile_core.sensor import read_frames

Array = NDArray[Any]

GROOVE = Path(__file__).resolve().parents[2] / "examples" / "groove.yaml"
ROWS = 514
WALLS = [((38, 66), (80, 112), 18), ((250, 275), (312, 335), 9), ((470, 486), (488, 502), 4)]
"""Columns of each groove's falling and rising wall, and how far its shoulders lie outside them."""
MARGIN_PX = 4

BEAR = """\
schema: 1
name: bear
image:
  {width_px: 612, height_px: 512, mm_per_px: 0.1, color: grey, transfer: linear, bit_depth: 16}
calibration: {use: desktop_six_led.photometric_stereo, lights: given}
estimators: {height: {use: core.robust_poisson}}
illumination: {use: core.sequential, lights: [
"""


def groove(data: Path) -> list[Row]:
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
        found = depths_mm(reading[HeightMap].mm.astype(np.float64)[unseen], true)
        known = depths_mm(true, true)
        off[way] = float(100 * np.abs(found / known - 1).max())
        depth_mm |= {f"depth of groove {i + 1}, mm, {way}": float(d) for i, d in enumerate(found)}
        errors[way], flat[way] = _normals_deg(reading[Gradients], true, unseen)
    depth_mm |= {f"maker's depth of groove {i + 1}, mm": float(d) for i, d in enumerate(known)}
    return [
        Row(
            "groove",
            "depth of the worst of three grooves against the maker's map, %",
            "six_led/groove: six lamps in turn; no untouched picture exists, the scan's own "
            "large-scale light stands in",
            "3 grooves on one part, half of the rows against the other",
            "out of sample in the rows only: other rows of the very scan that was fitted",
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
    """Median over rows of shoulders minus floor, for each groove."""
    gx = np.gradient(cv2.GaussianBlur(truth, (0, 0), 1), axis=1)
    found = []
    for (l0, l1), (r0, r1), far in WALLS:
        of_rows = []
        for row, slope in zip(height, gx, strict=True):
            left, right = l0 + np.argmin(slope[l0:l1]), r0 + np.argmax(slope[r0:r1])
            middle = (left + right) // 2
            near = [row[c - 1 : c + 2].mean() for c in (left - far, right + far, middle)]
            of_rows.append((near[0] + near[1]) / 2 - near[2])
        found.append(np.median(of_rows))
    return np.array(found)


def _normals_deg(measured: Gradients, truth: Array, rows: slice) -> tuple[float, float]:
    gy, gx = np.gradient(truth, measured.mm_per_px)
    true = np.stack([gx - np.median(gx), gy - np.median(gy)], axis=2)
    found = np.stack([measured.x[rows], measured.y[rows]], axis=2)
    inside = slice(MARGIN_PX, -MARGIN_PX), slice(MARGIN_PX, -MARGIN_PX)
    a, b = (field[inside].reshape(-1, 2) for field in (found, true))
    return float(angles_deg(a, b).mean()), float(angles_deg(np.zeros_like(b), b).mean())


def bear(data: Path) -> list[Row]:
    """Measure an object under lights that are given, with no calibration."""
    folder = data / "six_led" / "diligent_bear"
    with tempfile.TemporaryDirectory() as place:
        profile = record_object(folder, Path(place))
        pipeline = Pipeline(profile)
        (frame,) = read_frames(pipeline.profile, Path(place) / "bear")
        slopes = pipeline.process(frame)[Gradients]
    where = np.asarray(cv2.imread(str(folder / "mask.png"), cv2.IMREAD_GRAYSCALE)) > 0
    x, y = slopes.x[where], -slopes.y[where]  # this data set's y is up
    true = loadmat(str(folder / "Normal_gt.mat"))["Normal_gt"][where]
    value = _angle_deg(np.column_stack([-x, -y, np.ones_like(x)]), true)
    return [
        Row(
            "bear",
            "mean error of the normal, degrees",
            "six_led/diligent_bear: six of DiLiGenT's lights, given, no calibration and no gel",
            f"1 object, {np.count_nonzero(where)} pixels",
            "nothing is fitted; which six lights was chosen by the data set's keeper",
            {"lights given": value},
            value,
            {
                "predict flat": _angle_deg(np.tile([0.0, 0.0, 1.0], (len(true), 1)), true),
                "least squares of the six lights": _least_squares_deg(folder, where, true),
            },
            command("bear"),
        )
    ]


def record_object(folder: Path, into: Path) -> Path:
    """Write a data set's exposures in grey, over their lamps' strengths, and the rig's profile."""
    exposures, lights = _exposures(folder)
    brightest = max(exposure.max() for exposure in exposures)
    (into / "bear").mkdir()
    lines = []
    for k, (exposure, (x, y, z)) in enumerate(zip(exposures, lights, strict=True)):
        level = np.rint(65535 * exposure / brightest).astype(np.uint16)
        cv2.imwrite(str(into / "bear" / f"{k}.png"), level)
        azimuth, elevation = np.degrees([np.arctan2(-y, x), np.arcsin(z)])
        lines.append(
            f"{{name: light{k}, azimuth_deg: {azimuth:.3f}, elevation_deg: {elevation:.3f}}}"
        )
    profile = into / "bear.yaml"
    profile.write_text(BEAR + ",\n".join(lines) + "]}\n", encoding="utf-8")
    return profile


def _exposures(folder: Path) -> tuple[list[Array], Array]:
    names = (folder / "filenames.txt").read_text(encoding="utf-8").split()
    chosen = [k for k, name in enumerate(names) if (folder / name).exists()]
    strengths = np.loadtxt(folder / "light_intensities.txt")[chosen, ::-1]
    exposures = []
    for k, strength in zip(chosen, strengths, strict=True):
        image = np.asarray(cv2.imread(str(folder / names[k]), cv2.IMREAD_UNCHANGED))
        exposures.append(np.mean(image / strength, axis=2))
    return exposures, np.loadtxt(folder / "light_directions.txt")[chosen]


def _least_squares_deg(folder: Path, where: Array, true: Array) -> float:
    exposures, lights = _exposures(folder)
    seen = np.stack([exposure[where] for exposure in exposures], axis=1)
    return _angle_deg(np.linalg.lstsq(lights, seen.T, rcond=None)[0].T, true)


def _angle_deg(found: Array, true: Array) -> float:
    found = found / np.linalg.norm(found, axis=1, keepdims=True)
    return float(np.degrees(np.arccos(np.clip((found * true).sum(axis=1), -1, 1))).mean())
