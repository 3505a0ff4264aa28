"""Integration recovers the surface exactly."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactile_core.algorithms.poisson import integrate
from tactile_core.algorithms.poisson.integration import Boundary, between_cells, solve_poisson
from tactile_core.errors import InputError

Array = NDArray[Any]

MM_PER_PX = 0.05
BOUNDARIES: tuple[Boundary, ...] = ("neumann", "dirichlet")
SIZES = [(240, 320), (241, 307), (243, 251), (320, 240), (480, 641)]
seeds = st.integers(0, 2**32 - 1)
shapes = st.tuples(st.integers(1, 23), st.integers(1, 23))


def slopes_with_exact_face_means(z_mm: Array) -> tuple[Array, Array]:
    """Slopes whose mean over two neighbouring pixels is the difference of their heights."""

    def along_rows(z: Array) -> Array:
        slope = np.zeros_like(z)
        for i in range(1, len(z)):
            slope[i] = 2 * (z[i] - z[i - 1]) / MM_PER_PX - slope[i - 1]
        return slope

    return along_rows(z_mm.T).T, along_rows(z_mm)


def wave(shape: tuple[int, int], periods: float) -> tuple[Array, Array, Array]:
    k = 2 * np.pi * periods / shape[0]
    y, x = np.mgrid[: shape[0], : shape[1]].astype(float)
    z = np.sin(k * x + 0.4) * np.cos(k * y)
    gx, gy = np.cos(k * x + 0.4) * np.cos(k * y), -np.sin(k * x + 0.4) * np.sin(k * y)
    return z * MM_PER_PX, k * gx, k * gy


def bump(shape: tuple[int, int], share: float = 0.08) -> tuple[Array, Array, Array]:
    """Height map of a smooth hill that is practically 0 at the border."""
    y, x = np.mgrid[: shape[0], : shape[1]].astype(float)
    x, y, sigma = x - 0.47 * shape[1], y - 0.52 * shape[0], share * min(shape)
    z = np.exp(-(x**2 + y**2) / (2 * sigma**2))
    return z * MM_PER_PX, -x / sigma**2 * z, -y / sigma**2 * z


def cap(shape: tuple[int, int], radius_px: float, rim: float) -> tuple[Array, Array, Array]:
    """Height map of a spherical cap on a plane, with a step of the slope at its rim."""
    y, x = np.mgrid[: shape[0], : shape[1]].astype(float)
    x, y = x - 0.5 * shape[1] - 0.3, y - 0.5 * shape[0] + 0.2
    inside = np.hypot(x, y) < rim * radius_px
    depth = np.sqrt(np.maximum(radius_px**2 - x**2 - y**2, 1))
    z = np.where(inside, depth - radius_px * np.sqrt(1 - rim**2), 0)
    return z * MM_PER_PX, np.where(inside, -x / depth, 0), np.where(inside, -y / depth, 0)


def largest_error(height: Array, truth: Array) -> float:
    """Largest error, as a share of the range of the ground truth."""
    return float(np.abs(height - truth).max() / np.ptp(truth))


def centred(z: Array) -> Array:
    return np.asarray(z - z.mean())


@pytest.mark.parametrize("shape", SIZES)
@pytest.mark.parametrize("periods", [1, 2.5, 6])
def test_a_smooth_wave_is_recovered_to_a_thousandth(shape: tuple[int, int], periods: float) -> None:
    z, gx, gy = wave((shape[0], shape[1]), periods * shape[0] / 255)
    assert largest_error(integrate(gx, gy, mm_per_px=MM_PER_PX), centred(z)) <= 1e-3


@pytest.mark.parametrize("shape", [*SIZES, (480, 640), (257, 263)])
@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_a_smooth_bump_is_recovered_to_a_thousandth(
    shape: tuple[int, int], boundary: Boundary
) -> None:
    z, gx, gy = bump(shape)
    height = integrate(gx, gy, mm_per_px=MM_PER_PX, boundary=boundary)
    assert largest_error(height, centred(z) if boundary == "neumann" else z) <= 1e-3


@pytest.mark.parametrize("shape", [(120, 160), (127, 131)])
@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_small_images_are_recovered_to_two_thousandths(
    shape: tuple[int, int], boundary: Boundary
) -> None:
    z, gx, gy = bump(shape)
    height = integrate(gx, gy, mm_per_px=MM_PER_PX, boundary=boundary)
    assert largest_error(height, centred(z) if boundary == "neumann" else z) <= 2e-3


@pytest.mark.parametrize("shape", [(240, 320), (241, 307)])
def test_dirichlet_is_zero_one_step_outside_the_image(shape: tuple[int, int]) -> None:
    y, x = np.mgrid[1 : shape[0] + 1, 1 : shape[1] + 1].astype(float)
    a, b = np.pi / (shape[0] + 1), np.pi / (shape[1] + 1)
    z = MM_PER_PX * np.sin(a * y) * np.sin(b * x)
    gx, gy = b * np.sin(a * y) * np.cos(b * x), a * np.cos(a * y) * np.sin(b * x)
    height = integrate(gx, gy, mm_per_px=MM_PER_PX, boundary="dirichlet")
    assert largest_error(height, z) <= 1e-4


@pytest.mark.parametrize("shape", [(240, 320), (239, 313)])
@pytest.mark.parametrize(("radius_px", "rim"), [(60, 0.5), (60, 0.8), (30, 0.9)])
def test_a_cap_with_a_rim_is_recovered_to_a_fifth_of_a_pixel(
    shape: tuple[int, int], radius_px: float, rim: float
) -> None:
    z, gx, gy = cap(shape, radius_px, rim)
    error_px = (integrate(gx, gy, mm_per_px=MM_PER_PX) - centred(z)) / MM_PER_PX
    assert np.sqrt(np.mean(error_px**2)) <= 0.05
    # at a steep rim, the position of the step between two pixels is unknown
    y, x = np.mgrid[: shape[0], : shape[1]]
    r = np.hypot(x - 0.5 * shape[1] - 0.3, y - 0.5 * shape[0] + 0.2)
    assert np.abs(error_px[np.abs(r - rim * radius_px) > 3]).max() <= 0.2


@pytest.mark.parametrize("shape", [(48, 64), (47, 61), (480, 640), (241, 307)])
def test_exact_face_means_give_the_exact_surface(shape: tuple[int, int]) -> None:
    z = MM_PER_PX * np.random.default_rng(0).standard_normal(shape)
    gx, gy = slopes_with_exact_face_means(z)
    assert largest_error(integrate(gx, gy, mm_per_px=MM_PER_PX), centred(z)) <= 1e-6


@pytest.mark.parametrize("shape", [(48, 64), (47, 61), (480, 640), (241, 307)])
def test_single_precision_is_enough_for_a_rough_gel(shape: tuple[int, int]) -> None:
    z = cv2.GaussianBlur(np.random.default_rng(0).standard_normal(shape), (0, 0), 2)
    gx, gy = (g.astype(np.float32) for g in slopes_with_exact_face_means(z))
    assert largest_error(integrate(gx, gy, mm_per_px=MM_PER_PX), centred(z)) <= 1e-5


@pytest.mark.parametrize("shape", [(48, 64), (7, 5), (1, 9), (9, 1), (1, 1), (2, 2), (1, 2)])
def test_a_plane_integrates_to_itself(shape: tuple[int, int]) -> None:
    y, x = np.mgrid[: shape[0], : shape[1]]
    height = integrate(np.full(shape, 0.3), np.full(shape, -0.2), mm_per_px=MM_PER_PX)
    plane = MM_PER_PX * (0.3 * x - 0.2 * y)
    assert height.dtype == np.float32
    assert height == pytest.approx(centred(plane), abs=1e-6)


@settings(deadline=None)
@given(shapes, seeds, st.sampled_from(BOUNDARIES))
def test_integration_is_linear(shape: tuple[int, int], seed: int, boundary: Boundary) -> None:
    a, b = np.random.default_rng(seed).standard_normal((2, 2, *shape))
    whole = integrate(*(2 * a - 3 * b), mm_per_px=1, boundary=boundary)
    parts = [integrate(*g, mm_per_px=1, boundary=boundary) for g in (a, b)]
    assert whole == pytest.approx(2 * parts[0] - 3 * parts[1], abs=1e-4)


@settings(deadline=None)
@given(shapes, seeds, st.sampled_from(BOUNDARIES))
def test_exchanging_x_and_y_transposes_the_height(
    shape: tuple[int, int], seed: int, boundary: Boundary
) -> None:
    gx, gy = np.random.default_rng(seed).standard_normal((2, *shape))
    height = integrate(gx, gy, mm_per_px=1, boundary=boundary)
    turned = integrate(gy.T, gx.T, mm_per_px=1, boundary=boundary).T
    assert turned == pytest.approx(height, abs=1e-4)


@settings(deadline=None)
@given(shapes, seeds, st.floats(1e-3, 10))
def test_height_scales_with_the_size_of_a_pixel(
    shape: tuple[int, int], seed: int, mm_per_px: float
) -> None:
    gx, gy = np.random.default_rng(seed).standard_normal((2, *shape))
    one = integrate(gx, gy, mm_per_px=1)
    assert integrate(gx, gy, mm_per_px=mm_per_px) == pytest.approx(mm_per_px * one, rel=1e-5)


def flow_into_pixels(across: Array, down: Array) -> Array:
    """Divergence of values at the faces between pixels."""
    total = np.zeros((across.shape[0], down.shape[1]))
    total[:, :-1] += across
    total[:, 1:] -= across
    total[:-1] += down
    total[1:] -= down
    return total


@settings(deadline=None)
@given(shapes, seeds)
def test_any_slopes_satisfy_the_normal_equations(shape: tuple[int, int], seed: int) -> None:
    gx, gy = np.random.default_rng(seed).standard_normal((2, *shape))
    height = integrate(gx, gy, mm_per_px=1).astype(float)
    misfit_across = np.diff(height, axis=1) - (gx[:, 1:] + gx[:, :-1]) / 2
    misfit_down = np.diff(height, axis=0) - (gy[1:] + gy[:-1]) / 2
    balance = flow_into_pixels(misfit_across, misfit_down)
    assert balance == pytest.approx(np.zeros(shape), abs=2e-4)
    assert height.mean() == pytest.approx(0, abs=1e-5)


@pytest.mark.parametrize("boundary", BOUNDARIES)
@given(shape=shapes, seed=seeds)
@settings(max_examples=30, deadline=None)
def test_every_solver_inverts_its_laplacian(
    boundary: Boundary, shape: tuple[int, int], seed: int
) -> None:
    rhs = np.random.default_rng(seed).standard_normal(shape)
    if boundary == "neumann":
        rhs -= rhs.mean()
    z = solve_poisson(rhs.copy(), boundary)
    mode = "edge" if boundary == "neumann" else "constant"
    padded = np.pad(z, 1, mode=mode)  # type: ignore[call-overload]
    neighbours = padded[2:, 1:-1] + padded[:-2, 1:-1] + padded[1:-1, 2:] + padded[1:-1, :-2]
    assert neighbours - 4 * z == pytest.approx(rhs, abs=1e-9)


def test_no_input_is_overwritten() -> None:
    _, gx, gy = bump((60, 80))
    gx, gy = gx.astype(np.float32), gy.astype(np.float32)
    before = gx.copy(), gy.copy()
    integrate(gx, gy, mm_per_px=MM_PER_PX)
    assert np.array_equal(gx, before[0])
    assert np.array_equal(gy, before[1])


def test_slopes_may_be_slices_of_one_array() -> None:
    _, gx, gy = bump((60, 80))
    both = np.dstack([gx, gy]).astype(np.float32)
    whole = integrate(both[..., 0].copy(), both[..., 1].copy(), mm_per_px=1)
    assert np.array_equal(integrate(both[..., 0], both[..., 1], mm_per_px=1), whole)


ZEROS = np.zeros((4, 5))


@pytest.mark.parametrize(
    ("gx", "gy", "kwargs", "message"),
    [
        (ZEROS, ZEROS.T, {}, "gx is .4, 5. and gy .5, 4."),
        (ZEROS[0], ZEROS[0], {}, "cannot be integrated"),
        (np.zeros((0, 5)), np.zeros((0, 5)), {}, "at least one pixel"),
        (ZEROS, np.where(np.eye(4, 5), np.nan, 0), {}, "NaN or infinite"),
        (ZEROS, np.where(np.eye(4, 5), np.inf, 0), {"boundary": "dirichlet"}, "NaN or infinite"),
        (ZEROS, ZEROS, {"mm_per_px": 0}, "mm_per_px is 0"),
        (ZEROS, ZEROS, {"boundary": "periodic"}, "'periodic' is unknown"),
    ],
)
def test_bad_input_is_refused_in_one_sentence(
    gx: Array, gy: Array, kwargs: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        integrate(gx, gy, **({"mm_per_px": MM_PER_PX} | kwargs))


@pytest.mark.parametrize(("cells", "allowed"), [(8, 0.006), (16, 0.0005)])
def test_slopes_between_wide_cells_are_exact_to_the_fourth_order(
    cells: int, allowed: float
) -> None:
    z, gx, gy = wave((128, 160), 128 / cells)
    g32 = gx.astype(np.float32), gy.astype(np.float32)
    inside = np.s_[8:-8, 8:-8]

    def lost(slopes: tuple[Array, Array]) -> float:
        found = integrate(*slopes, mm_per_px=MM_PER_PX)
        return abs(1 - float(np.vdot(found[inside], z[inside]) / np.vdot(z[inside], z[inside])))

    assert lost(between_cells(*g32)) < allowed
    assert lost(g32) > 4 * lost(between_cells(*g32))
