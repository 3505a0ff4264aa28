"""Time of fitting, loading and the parts of the step from RGB to slopes: ``make bench``."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from tactile_core.algorithms.light.photometric import planes_to_gradient
from tactile_core.algorithms.slopes.sampling import Sampling
from tactile_core.interfaces.calibration import Calibration, Press
from tactile_core.interfaces.component import Component
from tactile_core.plugins.options import calibrator_of
from tactile_core.quantities import Frame, Reference

MODELS = ("core.mlp", "core.lookup_table", "core.polynomial")
SHAPES = ((240, 320), (480, 640), (1080, 1920))
CHANNELS = ("red", "green", "blue")
PRESSES = 20

models = pytest.mark.parametrize("use", MODELS)
sizes = pytest.mark.parametrize("shape", SHAPES, ids=lambda s: f"{s[1]}x{s[0]}")


def unit(shape: tuple[int, int]) -> tuple[list[Press], Reference]:
    """Presses of a ball under three lights whose intensity varies over the gel."""
    cv2.setNumThreads(1)
    rng = np.random.default_rng(0)
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float32)
    azimuth = np.radians([90, 210, 330])
    fade = 1 + 0.3 * np.stack([np.cos(a) * (2 * x / shape[1] - 1) for a in azimuth], 2)
    radius = 0.15 * shape[1]

    def light(sx: np.ndarray, sy: np.ndarray) -> np.ndarray:
        lit = [0.6 - 0.8 * (np.cos(a) * sx + np.sin(a) * sy) for a in azimuth]
        level = 200 * fade * np.sqrt(np.maximum(np.stack(lit, 2), 0.05)) / 1.4
        return np.clip(level + rng.normal(0, 1, level.shape), 0, 255).astype(np.uint8)

    presses = []
    for _ in range(PRESSES):
        cx, cy = (rng.uniform(0.2, 0.8) * side for side in shape[::-1])
        inside = np.hypot(x - cx, y - cy) < 0.75 * radius
        normal_xy = [np.where(inside, (centre - p) / radius, 0) for p, centre in ((x, cx), (y, cy))]
        frame = Frame(light(*normal_xy), CHANNELS, 0.05)
        rows, columns = np.nonzero(inside)
        targets = np.stack([s[inside] for s in normal_xy], 1)
        slopes = targets / np.sqrt(1 - (targets**2).sum(1, keepdims=True))
        pixels = rows.astype(np.int32), columns.astype(np.int32)
        presses.append(Press(frame, *pixels, slopes.astype(np.float32)))
    level = np.zeros(shape, np.float32)
    return presses, Reference(light(level, level).astype(np.float32), CHANNELS)


def fitted(use: str, presses: list[Press], reference: Reference) -> Calibration:
    return calibrator_of(Component(use=use)).fit(presses, reference)


@models
def bench_fit(benchmark, use):
    benchmark.pedantic(fitted, (use, *unit((480, 640))), rounds=2)


@models
def bench_load(benchmark, use, tmp_path: Path):
    model = fitted(use, *unit((480, 640)))
    model.save(tmp_path)
    benchmark(type(model).load, tmp_path)


@sizes
@models
def bench_measure(benchmark, use, shape):
    presses, reference = unit(shape)
    model = fitted(use, presses, reference)
    model.measure(presses[0].frame, reference)
    benchmark(model.measure, presses[1].frame, reference)


def bench_smoothing(benchmark):
    presses, _ = unit((480, 640))
    pixels = presses[0].frame.pixels
    benchmark(Sampling.for_shape(pixels.shape[:2], None, 2.0).smooth, pixels, None)


def bench_normal_xy_to_slopes(benchmark):
    normal_xy = np.random.default_rng(0).uniform(-0.4, 0.4, (2, 480, 640)).astype(np.float32)
    benchmark(lambda: planes_to_gradient(normal_xy[0].copy(), normal_xy[1].copy()))
