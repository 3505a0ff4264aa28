"""Time of the steps from slopes to height and contact: ``pytest benchmarks --benchmark-only``.

Set OMP_NUM_THREADS=1 to compare with single-core figures.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_core.algorithms.contact import contact_mask
from tactile_core.algorithms.heights.levelling import set_to_rest
from tactile_core.algorithms.markers.contrast import contrast_of, marker_mask
from tactile_core.algorithms.markers.detection import find_markers
from tactile_core.algorithms.poisson import integrate, integrate_robustly
from tactile_core.algorithms.poisson.integration import Boundary, solve_poisson

Array = NDArray[Any]

MM_PER_PX = 0.03
SHAPES = [(240, 320), (480, 640), (1080, 1920)]
sizes = pytest.mark.parametrize("shape", SHAPES, ids=lambda s: f"{s[1]}x{s[0]}")


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    yield
    cv2.setNumThreads(before)


def press(shape: tuple[int, int]) -> Array:
    """Height map of a ball press in the middle, float32, mm."""
    y, x = np.mgrid[: shape[0], : shape[1]] * MM_PER_PX
    r = np.hypot(x - x.mean(), y - y.mean())
    inside = np.sqrt(np.maximum(4 - r**2, 0)) - np.sqrt(4 - 1.4**2) + 0.5
    return np.asarray(np.where(r < 1.4, inside, 0.5 * np.exp(-(r - 1.4) / 0.5)), np.float32)


def slopes(shape: tuple[int, int]) -> tuple[Array, Array]:
    noise = np.random.default_rng(0).normal(0, 0.02, (2, *shape)).astype(np.float32)
    gy, gx = np.gradient(press(shape), np.float32(MM_PER_PX))
    return gx + noise[0], gy + noise[1]


def dots(shape: tuple[int, int], pitch: int = 57) -> Array:
    y, x = np.mgrid[: shape[0], : shape[1]]
    return np.asarray(np.hypot(x % pitch - pitch // 2, y % pitch - pitch // 2) < 7)


@sizes
@pytest.mark.parametrize("boundary", ["neumann", "dirichlet"])
def test_poisson(benchmark: Any, shape: tuple[int, int], boundary: Boundary) -> None:
    benchmark(integrate, *slopes(shape), mm_per_px=MM_PER_PX, boundary=boundary)


@sizes
@pytest.mark.parametrize("boundary", ["neumann", "dirichlet"])
def test_inverse_laplacian(benchmark: Any, shape: tuple[int, int], boundary: Boundary) -> None:
    rhs, _ = slopes(shape)
    benchmark(lambda: solve_poisson(rhs.copy(), boundary))


@sizes
@pytest.mark.parametrize("marked", [False, True], ids=["all_valid", "marked"])
def test_robust_poisson(benchmark: Any, shape: tuple[int, int], marked: bool) -> None:
    valid = ~dots(shape) if marked else None
    benchmark(integrate_robustly, *slopes(shape), mm_per_px=MM_PER_PX, valid=valid)


@sizes
def test_set_to_rest(benchmark: Any, shape: tuple[int, int]) -> None:
    gx, gy = slopes(shape)
    height = press(shape)
    benchmark(lambda: set_to_rest(height.copy(), gx, gy, mm_per_px=MM_PER_PX))


@sizes
def test_contact_mask(benchmark: Any, shape: tuple[int, int]) -> None:
    noise = np.random.default_rng(0).normal(0, 0.002, shape).astype(np.float32)
    benchmark(contact_mask, press(shape) + noise, mm_per_px=MM_PER_PX)


@sizes
def test_marker_mask(benchmark: Any, shape: tuple[int, int]) -> None:
    image = np.where(dots(shape)[..., None], 40, np.array([120, 150, 100])).astype(np.uint8)
    benchmark(marker_mask, image, diameter_px=14)


@sizes
def test_find_markers(benchmark: Any, shape: tuple[int, int]) -> None:
    image = np.where(dots(shape, 40)[..., None], 40, np.array([120, 150, 100])).astype(np.uint8)

    def both() -> Any:
        contrast = contrast_of(image, diameter_px=14)
        return find_markers(contrast, shape, diameter_px=14)

    benchmark(both)
