"""The compiled kernels agree with numpy, which is the definition."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_core.algorithms import kernels
from tactile_core.algorithms.arrays.quantile import quantile
from tactile_core.algorithms.colour_table import Axis, ColourTable
from tactile_core.algorithms.contact import contact_mask
from tactile_core.algorithms.displacement import MarkedSurface
from tactile_core.algorithms.drift import ReferenceLevels
from tactile_core.algorithms.marker_tracking import MarkerTracker
from tactile_core.algorithms.marker_tracking.neighbourhood import Neighbourhood
from tactile_core.algorithms.marker_tracking.pairing import paired
from tactile_core.algorithms.markers import contrast_of, mask_of
from tactile_core.algorithms.markers.kinds import kinds_of
from tactile_core.algorithms.markers.spots import Spots, measured_spots
from tactile_core.algorithms.poisson import PoissonSolver
from tactile_core.algorithms.rest_area import height_error
from tactile_core.algorithms.rest_surface import rest_plane
from tactile_core.algorithms.slip.contact_motion import contact_motion
from tactile_core.algorithms.slip.imprint import Imprint, step_between
from tactile_core.algorithms.slip.plane import positions_mm
from tactile_core.algorithms.slip.stick_region import stick_region
from tactile_core.algorithms.slip.surface_view import SurfaceView
from tactile_core.algorithms.slip.touched import steepness_of
from tactile_core.algorithms.slope_field import SlopeField

MM_PER_PX = 0.05
AGREES = 1e-5

needs_kernels = pytest.mark.skipif(
    kernels.load() is None, reason="numba is not installed, or TACTILE_FAST is 0"
)
seeds = st.integers(0, 2**32 - 1)
shapes = st.tuples(st.integers(1, 40), st.integers(1, 40))
several = settings(max_examples=15)


def both_ways(function: Callable[[bool], Any]) -> tuple[Any, Any]:
    """Results of a function with the kernels and without."""
    return function(True), function(False)


def press(shape: tuple[int, int], radius_mm: float = 1.5) -> np.ndarray:
    """Height map with a spherical cap of 0.4 mm on the undeformed surface."""
    y, x = np.mgrid[: shape[0], : shape[1]] * MM_PER_PX
    far = np.square(x - x.mean()) + np.square(y - y.mean())
    return np.asarray(np.maximum(0, 0.4 * (1 - far / radius_mm**2)), np.float32)


@needs_kernels
@given(shape=shapes, seed=seeds)
@several
def test_heights_agree_on_images_of_any_size(shape: tuple[int, int], seed: int) -> None:
    gx, gy = np.random.default_rng(seed).standard_normal((2, *shape)).astype(np.float32)
    fast, plain = both_ways(
        lambda compiled: PoissonSolver(shape, mm_per_px=MM_PER_PX, compiled=compiled).solve(gx, gy)
    )
    assert fast == pytest.approx(plain, abs=AGREES * max(float(np.ptp(plain)), 1e-3))


@needs_kernels
@pytest.mark.parametrize("shape", [(240, 320), (480, 640), (243, 251), (720, 1280)])
def test_heights_agree_on_a_press(shape: tuple[int, int]) -> None:
    gy, gx = (g.astype(np.float32) for g in np.gradient(press(shape, 4.0), MM_PER_PX))
    fast, plain = both_ways(
        lambda compiled: PoissonSolver(shape, mm_per_px=MM_PER_PX, compiled=compiled).solve(gx, gy)
    )
    assert fast == pytest.approx(plain, abs=AGREES * float(np.ptp(plain)))


@needs_kernels
@pytest.mark.parametrize("per_unit", [40.0, 80.0, 113.7])
def test_every_pair_of_bytes_finds_the_same_entry(per_unit: float) -> None:
    levels = np.arange(256, dtype=np.uint8)
    pixels = np.stack([np.tile(levels, (246, 1))] * 3, axis=2)
    reference = np.stack([np.tile(np.arange(10, 256)[:, None], (1, 256))] * 3, axis=2)
    normal_xy = np.random.default_rng(0).uniform(-0.6, 0.6, (2, 80, 80, 80)).astype(np.float32)
    table = ColourTable(Axis(per_unit, first=25, count=80), normal_xy[0] + 1j * normal_xy[1])

    def slopes(compiled: bool) -> np.ndarray:
        nothing = SlopeField(
            lambda features: np.zeros((len(features), 2), np.float32),
            table,
            reference.astype(np.float32),
            blur_px=0,
            compiled=compiled,
        )
        return np.stack(nothing.measure(pixels)[:2])

    fast, plain = both_ways(slopes)
    assert fast == pytest.approx(plain, rel=AGREES, abs=AGREES)


@needs_kernels
@pytest.mark.parametrize("shape", [(240, 320), (241, 318)])
@pytest.mark.parametrize("gain", [0.5, 4.0], ids=["gentle", "too steep"])
@pytest.mark.parametrize("pitch", [17, 1000], ids=["markers", "no markers"])
def test_slopes_agree(shape: tuple[int, int], gain: float, pitch: int) -> None:
    rng = np.random.default_rng(0)
    reference = rng.uniform(90, 140, (*shape, 3)).astype(np.float32)
    y, x = np.mgrid[: shape[0], : shape[1]]
    waves = np.stack([np.sin(x / 30 + k) * np.cos(y / 40 - k) for k in range(3)], axis=2)
    pixels = np.rint(reference * (1 + 0.3 * waves)).astype(np.uint8)
    axis = Axis(per_unit=80, first=45, count=80)
    values = axis.values()
    normal_xy = gain * (values[:, None, None] + 1j * values[None, :, None] + 0 * values)
    table = ColourTable(axis, np.asarray(normal_xy, np.complex64))

    hidden = np.hypot(x % pitch - 8, y % pitch - 8) < 4

    def model(features: np.ndarray) -> np.ndarray:
        return np.asarray(gain * features[:, :2] * (1 + 0.2 * features[:, 3:4]), np.float32)

    fast, plain = both_ways(
        lambda compiled: np.stack(
            SlopeField(model, table, reference, hidden, compiled=compiled).measure(pixels, hidden)[
                :2
            ]
        )
    )
    assert fast == pytest.approx(plain, rel=AGREES, abs=AGREES)


@needs_kernels
@given(shape=shapes, seed=seeds, slope=st.floats(-0.08, 0.08))
@several
def test_rest_planes_agree(shape: tuple[int, int], seed: int, slope: float) -> None:
    noise = np.random.default_rng(seed).normal(0, 1e-3, shape)
    x_mm = np.arange(shape[1]) * MM_PER_PX
    height = np.asarray(press(shape, 0.3) + noise + slope * x_mm, np.float32)
    gx, gy = np.full(shape, slope, np.float32), np.zeros(shape, np.float32)

    def above(compiled: bool) -> np.ndarray:
        plane = rest_plane(height, gx, gy, mm_per_px=MM_PER_PX, compiled=compiled)
        return plane.removed_from(height, MM_PER_PX)

    fast, plain = both_ways(above)
    assert fast == pytest.approx(plain, abs=AGREES)


def loaded_in_a_fresh_process(*, switch: str, compiled: bool) -> bool:
    code = f"from tactile_core.algorithms import kernels; print(kernels.chosen({compiled}))"
    environment = {**os.environ, kernels.SWITCH: switch}
    command = [sys.executable, "-c", code]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return run.stdout.strip() != "None"


@needs_kernels
def test_numba_is_imported_only_on_request() -> None:
    assert not loaded_in_a_fresh_process(switch="", compiled=False)
    assert loaded_in_a_fresh_process(switch="", compiled=True)


def test_the_environment_turns_the_kernels_off() -> None:
    assert not loaded_in_a_fresh_process(switch="0", compiled=True)


@needs_kernels
@given(shape=shapes, seed=seeds, share=st.floats(0, 1))
@several
def test_spots_agree(shape: tuple[int, int], seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    dark = (rng.random(shape) < share).astype(np.uint8)
    weight = rng.integers(0, 256, shape).astype(np.uint8)
    fast, plain = both_ways(
        lambda compiled: measured_spots(dark, weight, weight, faintest=20, rim=1, compiled=compiled)
    )
    for name in ("mass", "centres", "sigma_px", "peak", "truncated"):
        a, b = getattr(fast, name), getattr(plain, name)
        assert a == pytest.approx(b, rel=AGREES, abs=AGREES)


@needs_kernels
@given(shape=shapes, seed=seeds, reach=st.integers(1, 3))
@several
def test_spots_are_numbered_alike(shape: tuple[int, int], seed: int, reach: int) -> None:
    rng = np.random.default_rng(seed)
    dark = (cv2.GaussianBlur(rng.random(shape), (0, 0), 1.5) > 0.5).astype(np.uint8)
    weight = rng.integers(1, 256, shape).astype(np.uint8)
    fast, plain = both_ways(
        lambda compiled: measured_spots(
            dark, weight, weight, faintest=0, rim=reach, compiled=compiled
        )
    )
    np.testing.assert_array_equal(fast.mass, plain.mass)
    np.testing.assert_array_equal(fast.truncated, plain.truncated)


@needs_kernels
@given(seed=seeds, count=st.integers(1, 60))
@several
def test_kinds_of_spots_agree(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    minor = rng.uniform(1, 3, count)
    mass = 255 * rng.lognormal(3, 1, count)
    spots = Spots(
        mass,
        rng.uniform(0, 99, (count, 2)),
        rng.uniform(-1.5, 1.5, count),
        np.stack([minor * rng.uniform(1, 3, count), minor], axis=1),
        rng.integers(40, 200, count).astype(np.uint8),
        rng.random((count, 4)) < 0.05,
    )
    fast, plain = both_ways(lambda compiled: kinds_of(spots, compiled=compiled))
    for name in ("marker", "piece", "bar", "truncated"):
        np.testing.assert_array_equal(getattr(fast, name), getattr(plain, name))
    assert fast.half_size == pytest.approx(plain.half_size)
    if fast.half_size > 0:
        np.testing.assert_allclose(fast.mass, plain.mass)


@needs_kernels
@pytest.mark.skipif(cv2.__version__ < "5", reason="this OpenCV rounds the places of samples")
@given(seed=seeds, unseen=st.sampled_from([0.0, 0.1]), radius_px=st.floats(0, 60))
@several
def test_displacements_agree(seed: int, unseen: float, radius_px: float) -> None:
    rng = np.random.default_rng(seed)
    markers = np.stack(np.meshgrid(np.arange(5, 160, 11), np.arange(5, 120, 11)), -1)
    markers = markers.reshape(-1, 2) + rng.uniform(-2, 2, (165, 2))
    y, x = np.mgrid[:120, :160]
    contact = np.hypot(x - 70, y - 50) < radius_px
    far = np.hypot(*(markers - [70, 50]).T)[:, None]
    now = markers + [4, -2] * np.exp(-((far / 30) ** 2)) + rng.normal(0, 0.1, markers.shape)
    seen = rng.random(len(markers)) >= unseen
    fast, plain = both_ways(
        lambda compiled: MarkedSurface(
            markers, (120, 160), mm_per_px=0.1, compiled=compiled
        ).measured(now, seen, contact)
    )
    np.testing.assert_allclose(fast.cells_mm, plain.cells_mm, atol=AGREES)
    np.testing.assert_allclose(fast.std_cells_mm, plain.std_cells_mm, rtol=1e-4, atol=AGREES)


@needs_kernels
@pytest.mark.parametrize("diameter_px", [7, 14, 20, 26])
@pytest.mark.parametrize("shape", [(48, 64, 3), (49, 66, 3), (48, 64), (48, 64, 4)])
def test_contrast_and_mask_are_the_same_bytes(shape: tuple[int, ...], diameter_px: float) -> None:
    noise = np.random.default_rng(0).uniform(-200, 455, shape)
    image = np.clip(cv2.GaussianBlur(noise, (0, 0), 1), 0, 255).astype(np.uint8)
    fast, plain = both_ways(
        lambda compiled: contrast_of(image, diameter_px=diameter_px, compiled=compiled)
    )
    np.testing.assert_array_equal(fast, plain)
    fast, plain = both_ways(lambda compiled: mask_of(plain, shape[:2], compiled=compiled))
    np.testing.assert_array_equal(fast, plain)
    assert 0 < plain.mean() < 1


@needs_kernels
@given(seeds)
@several
def test_neighbours_agree(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places, found = rng.uniform(0, 300, (40, 2)), rng.uniform(0, 300, (35, 2))
    values, trust = rng.normal(size=(40, 2)), rng.uniform(0, 1, 40)
    gates = np.where(rng.random(40) < 0.2, -1.0, rng.uniform(5, 60, 40))
    fast, plain = both_ways(lambda c: Neighbourhood.of(places, compiled=c).fit(values, trust))
    assert fast == pytest.approx(plain, abs=1e-6)
    fast, plain = both_ways(
        lambda c: Neighbourhood.of(places, compiled=c).spacing_px(places + values)
    )
    assert fast == pytest.approx(plain, abs=1e-6)
    fast, plain = both_ways(lambda c: paired(places, found, gates, compiled=c))
    np.testing.assert_array_equal(fast, plain)


@needs_kernels
@given(seeds, st.sampled_from([0.0, 0.05, 0.3]))
@settings(max_examples=6)
def test_tracks_agree(seed: int, missing: float) -> None:
    rng = np.random.default_rng(seed)
    rest = 30.0 * np.stack(np.meshgrid(np.arange(14), np.arange(11)), axis=-1).reshape(-1, 2)
    far = np.square(rest - rest.mean(axis=0)).sum(axis=1, keepdims=True)
    shear = np.exp(-far / 2e4) * [7.5, 3.0]
    shown = [
        (rest + shear * k + rng.normal(0, 0.2, rest.shape))[rng.random(len(rest)) >= missing]
        for k in range(6)
    ]

    def followed(compiled: bool) -> list[np.ndarray]:
        tracker, tracks = MarkerTracker(rest, compiled=compiled), []
        for found in shown:
            tracker.update(found)
            tracks.append(np.column_stack([tracker.px, tracker.seen]))
        return tracks

    fast, plain = both_ways(followed)
    np.testing.assert_allclose(fast, plain, rtol=0, atol=1e-6)


@needs_kernels
@given(seeds, st.floats(0, 3))
@settings(max_examples=6)
def test_imprints_agree(seed: int, moved_px: float) -> None:
    rng = np.random.default_rng(seed)
    markers = 24.0 * np.stack(np.meshgrid(np.arange(1, 12), np.arange(1, 9)), -1).reshape(-1, 2)
    noise = cv2.GaussianBlur(rng.normal(0, 1, (240, 640, 3)).astype(np.float32), (0, 0), 2)
    frames = [np.clip(120 + 100 * half, 60, 250).astype(np.uint8) for half in np.split(noise, 2, 1)]
    frames = [np.ascontiguousarray(frame) for frame in frames]
    for x, y in markers.astype(int).tolist():
        for frame in frames:
            cv2.circle(frame, (x, y), 4, (5, 5, 5), cv2.FILLED)
    px = markers + rng.normal(0, moved_px, markers.shape)

    def imprints(compiled: bool) -> list[Imprint]:
        view = SurfaceView(frames[0], markers, 8.0, compiled=compiled)
        return [Imprint(*view.imprint(pixels, px), compiled=compiled) for pixels in frames]

    fast, plain = both_ways(imprints)
    for one, other in zip(fast, plain, strict=True):
        np.testing.assert_array_equal(one.seen, other.seen)
        np.testing.assert_allclose(one.pattern, other.pattern, rtol=0, atol=AGREES)
        for name in ("energy", "count", "centre", "radius"):
            assert getattr(one, name) == pytest.approx(getattr(other, name), rel=AGREES)
    one, other = step_between(*fast), step_between(*plain)
    for name in ("changed", "unexplained", "energy", "values", "variance"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), rel=10 * AGREES)
    assert one.motion == pytest.approx(other.motion, abs=10 * AGREES)


@needs_kernels
@pytest.mark.parametrize("shape", [(120, 160), (97, 131), (12, 9)])
@pytest.mark.parametrize("tilt", [0.0, 0.03])
def test_smooth_errors_agree(shape: tuple[int, int], tilt: float) -> None:
    y, x = np.mgrid[: shape[0], : shape[1]] * MM_PER_PX
    height = press(shape) + 0.02 * np.cos(x / 2.9) * np.cos(y / 2.3) + tilt * x
    gy, gx = (g.astype(np.float32) for g in np.gradient(height, MM_PER_PX))
    fast, plain = both_ways(
        lambda compiled: height_error(
            height.astype(np.float32), gx, gy, mm_per_px=MM_PER_PX, compiled=compiled
        )
    )
    assert fast == pytest.approx(plain, abs=AGREES * float(np.ptp(height)))


@needs_kernels
@pytest.mark.parametrize("shape", [(48, 64, 3), (97, 131, 6), (480, 640, 1)])
@pytest.mark.parametrize("marked", [True, False])
def test_light_changes_agree(shape: tuple[int, int, int], marked: bool) -> None:
    rng = np.random.default_rng(0)
    reference = rng.uniform(5, 240, shape).astype(np.float32)
    gains = rng.normal(1, 0.03, shape[2]) * rng.normal(1, 0.01, shape)
    pixels = np.rint(np.clip(reference * gains, 0, 255)).astype(np.uint8)
    hidden = rng.random(shape[:2]) < 0.1 if marked else None
    fast, plain = both_ways(
        lambda compiled: np.hstack(
            ReferenceLevels(reference, 255.0, compiled=compiled).change(pixels, hidden) or ()
        )
    )
    assert plain.size == shape[2] + 1
    assert fast == pytest.approx(plain, rel=AGREES, abs=AGREES)


@needs_kernels
@pytest.mark.parametrize(("shape", "step_px"), [((120, 160), 1), ((240, 320), 2), ((96, 88), 3)])
@given(seed=seeds, noise_mm=st.sampled_from([0.0, 0.01]))
@settings(max_examples=6)
def test_contacts_agree(shape: tuple[int, int], step_px: int, seed: int, noise_mm: float) -> None:
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[: shape[0], : shape[1]]
    height = noise_mm * cv2.GaussianBlur(rng.normal(0, 3, shape), (0, 0), 2)
    for _ in range(3):  # they may overlap each other, or leave the view
        centre, radius = rng.uniform(0, shape), rng.uniform(5, 30)
        cap = 1 - (np.square(y - centre[0]) + np.square(x - centre[1])) / radius**2
        height = np.maximum(height, rng.uniform(0.1, 0.5) * cap)

    def mask(compiled: bool) -> np.ndarray:
        return contact_mask(
            height.astype(np.float32), mm_per_px=0.05 / step_px, step_px=step_px, compiled=compiled
        )

    fast, plain = both_ways(mask)
    np.testing.assert_array_equal(fast, plain)


@needs_kernels
@given(seed=seeds, count=st.integers(1, 600), share=st.floats(0, 1), even=st.booleans())
@several
def test_quantiles_agree(seed: int, count: int, share: float, even: bool) -> None:
    from tactile_core.algorithms.kernels.selection import quantile_of

    values = np.random.default_rng(seed).exponential(1.0, count).astype(np.float32)
    values = np.floor(3 * values) if even else values
    assert quantile_of(values, share) == pytest.approx(quantile(values, share), rel=1e-6)


@needs_kernels
@pytest.mark.parametrize("at_mm", [0.0, 6.0], ids=["inside", "at the border"])
@given(seed=seeds, every=st.integers(1, 3))
@settings(max_examples=6)
def test_the_motion_of_a_contact_agrees(at_mm: float, seed: int, every: int) -> None:
    spacing_mm, noise = 0.22, np.random.default_rng(seed).normal(0, 0.02, (2, 60, 80, 2))
    place = positions_mm((60, 80), spacing_mm)
    mask = np.abs(place - at_mm * (1 + 1j)) < 3.0
    before, now = (
        (0.05 * k + cv2.GaussianBlur(each, (0, 0), 2).view(np.complex128)[..., 0] + 0.02j * place)
        for k, each in enumerate(noise)
    )
    fields = now.astype(np.complex64), before.astype(np.complex64)
    fast, plain = both_ways(
        lambda compiled: contact_motion(*fields, spacing_mm, mask, every, compiled=compiled)
    )
    for name in ("displacement", "weight", "entropy_bits"):
        np.testing.assert_allclose(getattr(fast, name), getattr(plain, name), rtol=0, atol=AGREES)
    position = place[mask][::every]
    fast, plain = both_ways(
        lambda compiled: stick_region(plain.displacement, position, plain.weight, compiled=compiled)
    )
    for name in ("shift_mm", "rotation_rad", "motion_mm", "rotation_mm", "sheared_mm"):
        assert getattr(fast, name) == pytest.approx(getattr(plain, name), abs=AGREES)
    for name in ("lag_mm", "weight"):
        np.testing.assert_allclose(getattr(fast, name), getattr(plain, name), rtol=0, atol=AGREES)


@needs_kernels
@pytest.mark.parametrize(("shape", "step_px"), [((120, 160), 4), ((240, 320), 2), ((121, 161), 4)])
def test_the_steepness_on_the_grid_of_slip_agrees(shape: tuple[int, int], step_px: int) -> None:
    noise = np.random.default_rng(0).normal(0, 1, shape).astype(np.float32)
    cells = cv2.GaussianBlur(noise, (0, 0), 2)
    fast, plain = both_ways(
        lambda compiled: steepness_of(
            cells, step_px, (480, 640), 8, spacing_mm=0.22, compiled=compiled
        )
    )
    np.testing.assert_allclose(fast[0], plain[0], rtol=0, atol=AGREES)
    assert fast[1] == pytest.approx(plain[1], abs=AGREES)
