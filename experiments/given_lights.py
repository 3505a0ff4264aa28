"""Photometric stereo of an object under given lights, without calibration or gel."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat

from experiments.table_row import Row, command
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import read_frames
from tactile_core.quantities import Gradients

Array = NDArray[Any]

BEAR = """\
schema: 1
name: bear
image:
  {width_px: 612, height_px: 512, mm_per_px: 0.1, color: grey, transfer: linear, bit_depth: 16}
calibration: {use: desktop_six_led.photometric_stereo, lights: given}
estimators: {height: {use: core.robust_poisson}}
illumination: {use: core.sequential, lights: [
"""


def rows(data: Path) -> list[Row]:
    """Measure an object under given lights, without calibration."""
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
    """Write a data set's exposures as grey images, normalised by light intensity, and a profile."""
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
    intensities = np.stack([exposure[where] for exposure in exposures], axis=1)
    return _angle_deg(np.linalg.lstsq(lights, intensities.T, rcond=None)[0].T, true)


def _angle_deg(vectors: Array, true: Array) -> float:
    """Mean angle between vectors and true unit normals, degrees."""
    normals = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return float(np.degrees(np.arccos(np.clip((normals * true).sum(axis=1), -1, 1))).mean())
