"""A few outliers among the slopes do not bend the surface."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.algorithms.poisson import integrate, integrate_robustly
from tactile_core.errors import InputError

Array = NDArray[Any]
Bool = NDArray[np.bool_]

SHAPE, MM_PER_PX = (240, 320), 0.03
BALL = BallPress((150.4, 124.8), 4.0, 0.9)
NOISE_SLOPE = 0.02


def ball() -> tuple[Array, Array, Array]:
    """Height map of a pressed ball, and its slopes with sensor noise."""
    z = BALL.height_mm(SHAPE, MM_PER_PX)
    gy, gx = np.gradient(z, MM_PER_PX)
    noise = np.random.default_rng(0).normal(0, NOISE_SLOPE, (2, *SHAPE))
    return z, gx + noise[0], gy + noise[1]


def flank() -> Bool:
    """Mask of a crescent on one side of the ball, along the border of the contact."""
    x = np.arange(SHAPE[1]) - BALL.centre_px[0]
    y = np.arange(SHAPE[0])[:, None] - BALL.centre_px[1]
    r = np.hypot(x, y) * MM_PER_PX / BALL.contact_radius_mm
    return np.asarray((r > 0.75) & (r < 1.05) & (np.abs(np.arctan2(y, x) - 0.5) < 0.8))


def discs(pitch_px: int = 40, radius_px: float = 6) -> list[Bool]:
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    return [
        np.asarray(np.hypot(x - cx, y - cy) < radius_px)
        for cy in range(pitch_px // 2, SHAPE[0], pitch_px)
        for cx in range(pitch_px // 2, SHAPE[1], pitch_px)
    ]


def rms(height: Array, truth: Array) -> float:
    off = height - truth
    return float(np.sqrt(np.mean((off - np.median(off)) ** 2)))


def gain(truth: Array, gx: Array, gy: Array, valid: Bool | None = None) -> float:
    """Ratio of the error of least squares to that of robust integration."""
    robust = integrate_robustly(gx, gy, mm_per_px=MM_PER_PX, valid=valid)
    return rms(integrate(gx, gy, mm_per_px=MM_PER_PX), truth) / rms(robust, truth)


@given(
    seed=st.integers(0, 2**32 - 1),
    shape=st.tuples(st.integers(1, 40), st.integers(1, 40)),
    tall_mm=st.floats(1e-3, 5),
    mm_per_px=st.floats(0.01, 0.1),
)
@settings(max_examples=30, deadline=None)
def test_consistent_slopes_give_the_least_squares_height(
    seed: int, shape: tuple[int, int], tall_mm: float, mm_per_px: float
) -> None:
    k = np.random.default_rng(seed).uniform(-0.3, 0.3, 2)
    y, x = np.mgrid[: shape[0], : shape[1]].astype(float)
    wave = tall_mm * np.cos(k[0] * x + k[1] * y)
    # the trapezoidal slopes of a wave along one direction are consistent with a surface
    gx, gy = (-np.sin(k[0] * x + k[1] * y) * tall_mm * ki / mm_per_px for ki in k)
    plain = integrate(gx, gy, mm_per_px=mm_per_px)
    misfit = max(
        float(np.abs(np.diff(plain, axis=axis) - mm_per_px * mean).max(initial=0)) / mm_per_px
        for axis, mean in ((1, (gx[:, 1:] + gx[:, :-1]) / 2), (0, (gy[1:] + gy[:-1]) / 2))
    )
    robust = integrate_robustly(gx, gy, mm_per_px=mm_per_px, outlier_slope=1.01 * misfit + 1e-3)
    np.testing.assert_allclose(robust, plain, atol=1e-4 * max(float(np.ptp(wave)), 1e-3))


def test_noise_alone_gives_the_error_of_least_squares() -> None:
    z, gx, gy = ball()
    plain = integrate(gx, gy, mm_per_px=MM_PER_PX)
    robust = integrate_robustly(gx, gy, mm_per_px=MM_PER_PX)
    assert rms(robust, plain) < 1e-3 * z.max()
    assert rms(robust, z) < 1.1 * rms(plain, z)


def test_salt_and_pepper_noise_leaves_little_error() -> None:
    z, gx, gy = ball()
    rng = np.random.default_rng(1)
    for slope in (gx, gy):
        hit = rng.random(SHAPE) < 0.05
        slope[hit] = rng.choice([-3, 3], hit.sum())
    assert gain(z, gx, gy) > 7


@pytest.mark.parametrize(("left", "least"), [(0.3, 2.0), (0.0, 2.0)])
def test_a_shadow_on_one_flank_tilts_neither_ball_nor_gel(left: float, least: float) -> None:
    z, gx, gy = ball()
    gx, gy = (np.where(flank(), left * slope, slope) for slope in (gx, gy))
    assert gain(z, gx, gy) > least


def test_a_masked_shadow_bends_the_height_even_less() -> None:
    z, gx, gy = ball()
    gx, gy = (np.where(flank(), 0.3 * slope, slope) for slope in (gx, gy))
    assert gain(z, gx, gy, ~flank()) > 1.5 * gain(z, gx, gy)


def test_markers_with_wrong_slopes_leave_their_surroundings_unchanged() -> None:
    z, gx, gy = ball()
    rng = np.random.default_rng(2)
    markers = discs()
    for marker in markers:
        gx[marker] += 0.5 * rng.normal()
        gy[marker] += 0.5 * rng.normal()
    assert gain(z, gx, gy, ~np.any(markers, axis=0)) > 8


def test_well_filled_markers_keep_their_shape() -> None:
    z, gx, gy = ball()
    valid = ~np.any(discs(), axis=0)
    robust = integrate_robustly(gx, gy, mm_per_px=MM_PER_PX, valid=valid)
    assert rms(robust, z) < 1.5 * rms(integrate(gx, gy, mm_per_px=MM_PER_PX), z)


def huber(z: Array, gx: Array, gy: Array, outlier_slope: float) -> float:
    total = 0.0
    for axis, mean in ((1, (gx[:, 1:] + gx[:, :-1]) / 2), (0, (gy[1:] + gy[:-1]) / 2)):
        misfit = np.abs(np.diff(z, axis=axis) / MM_PER_PX - mean)
        square = misfit**2 / (2 * outlier_slope)
        total += float(np.where(misfit < outlier_slope, square, misfit - outlier_slope / 2).sum())
    return total


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_no_other_surface_fits_better_in_the_sense_of_huber(seed: int) -> None:
    rng = np.random.default_rng(seed)
    gx, gy = rng.standard_t(1.5, (2, 15, 20)).clip(-4, 4) * 0.3
    z = integrate_robustly(gx, gy, mm_per_px=MM_PER_PX, outlier_slope=0.1, rounds=400)
    best = huber(z.astype(float), gx, gy, 0.1)
    for size in (1e-3, 0.1, 1.0):
        other = z + size * MM_PER_PX * rng.normal(size=z.shape)
        assert huber(other, gx, gy, 0.1) > best
    eight = integrate_robustly(gx, gy, mm_per_px=MM_PER_PX, outlier_slope=0.1)
    plain = integrate(gx, gy, mm_per_px=MM_PER_PX)
    # a few rounds already go most of the way from the least-squares height
    left = huber(eight, gx, gy, 0.1) - best
    assert left < 0.25 * (huber(plain, gx, gy, 0.1) - best)


def test_unusable_input_is_refused() -> None:
    flat = np.zeros((4, 5))
    with pytest.raises(InputError, match="valid"):
        integrate_robustly(flat, flat, mm_per_px=0.1, valid=np.ones((5, 4), bool))
    with pytest.raises(InputError, match="NaN"):
        integrate_robustly(flat * np.nan, flat, mm_per_px=0.1)
    with pytest.raises(InputError, match="mm_per_px"):
        integrate_robustly(flat, flat, mm_per_px=0)
