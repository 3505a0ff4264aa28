"""The stick region of fields for which it is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactile_core.algorithms.slip.recent_fields import (
    as_complex,
    coarse,
    displacement_since,
    positions_mm,
    strain,
    stride_of,
)
from tactile_core.algorithms.slip.stick_region import StickRegion, calm_weights, stick_region

SPACING_MM = 0.22
SHAPE = (60, 80)
PLACE = positions_mm(SHAPE, SPACING_MM)
RADIUS_MM = 4.0
CONTACT = np.abs(PLACE) < RADIUS_MM


def _found(displacement: NDArray[Any]) -> StickRegion:
    displacement = displacement.astype(np.complex64)
    moved = displacement[CONTACT]
    start = calm_weights(moved, strain(displacement, SPACING_MM, np.flatnonzero(CONTACT)))
    return stick_region(moved, PLACE[CONTACT], start)


def _partly_slipping(motion: NDArray[Any], stick_radius_mm: float) -> NDArray[Any]:
    """Motion with a lag that grows with the distance from a stick region."""
    beyond = np.clip((np.abs(PLACE) - stick_radius_mm) / RADIUS_MM, 0, None)
    return np.asarray(motion / (1 + 4 * beyond))


def _turned(angle_rad: float, about: complex) -> NDArray[Any]:
    """Displacement under a rigid rotation, at present positions."""
    return np.asarray((1 - np.exp(-1j * angle_rad)) * (PLACE - about))


@settings(max_examples=30, deadline=None)
@given(
    st.complex_numbers(min_magnitude=0.02, max_magnitude=1),
    st.floats(-0.4, 0.4),
    st.complex_numbers(max_magnitude=3),
)
def test_a_rigid_motion_of_the_whole_contact_is_recovered(
    shift: complex, angle_rad: float, about: complex
) -> None:
    region = _found(shift + _turned(angle_rad, about))
    assert region.rotation_rad == pytest.approx(angle_rad, abs=1e-3)
    assert region.stick_share(0.2) == 1
    assert region.lag_mm.max() < 1e-4


@pytest.mark.parametrize("stick_radius_mm", [1.5, 2.5, 3.5])
@pytest.mark.parametrize("direction", [1, 1j, np.exp(2j)])
def test_the_stick_region_is_found_inside_a_slipping_border(
    stick_radius_mm: float, direction: complex
) -> None:
    field = _partly_slipping(np.full(SHAPE, 0.4 * direction), stick_radius_mm)
    region = _found(field)
    assert region.shift_mm == pytest.approx(0.4 * direction, rel=0.02)
    assert region.stick_share(0.01) == pytest.approx((stick_radius_mm / RADIUS_MM) ** 2, abs=0.08)


@pytest.mark.parametrize("stick_radius_mm", [2.5, 3.0, 3.5])
def test_the_rotation_is_that_of_the_stick_region(stick_radius_mm: float) -> None:
    region = _found(_partly_slipping(_turned(0.08, 0), stick_radius_mm))
    assert region.rotation_rad == pytest.approx(0.08, rel=0.03)
    assert region.rotation_mm == pytest.approx(region.motion_mm, rel=0.02)


def test_the_stick_share_falls_with_the_stick_region() -> None:
    shares = [
        _found(_partly_slipping(np.full(SHAPE, 0.3 + 0.1j), radius)).stick_share(0.2)
        for radius in (4.0, 3.0, 2.0, 1.0, 0.5)
    ]
    assert shares == sorted(shares, reverse=True)


def test_noise_of_a_tenth_of_a_pixel_changes_the_stick_share_little() -> None:
    rng = np.random.default_rng(3)
    noise = rng.normal(0, 0.002, (2, *SHAPE))
    clean = _partly_slipping(np.full(SHAPE, 0.2 + 0j), 2.5)
    noisy = _found(clean + noise[0] + 1j * noise[1])
    assert noisy.stick_share(0.2) == pytest.approx(_found(clean).stick_share(0.2), abs=0.03)


def test_since_compares_the_same_surface_points() -> None:
    # a field that varies in space is shifted by many grid points
    def of_gel(surface: NDArray[Any]) -> NDArray[Any]:
        return np.asarray(0.05 * np.sin(surface.real) + 0.03j * np.cos(surface.imag / 2))

    shift = 0.5 - 0.3j
    surface = PLACE.copy()
    for _ in range(20):
        surface = PLACE - of_gel(surface)
    before = of_gel(surface).astype(np.complex64)
    surface = PLACE - shift
    for _ in range(20):
        surface = PLACE - shift - of_gel(surface)
    now = (shift + of_gel(surface)).astype(np.complex64)
    inside = np.s_[8:-8, 8:-8]
    moved = displacement_since(now, before, SPACING_MM)
    np.testing.assert_allclose(moved[inside], np.full_like(moved[inside], shift), atol=2e-3)


def test_strain_is_that_of_a_stretch_and_zero_for_a_rotation() -> None:
    inside = np.arange(PLACE.size).reshape(SHAPE)[2:-2, 2:-2].ravel()
    stretched = strain((0.02 * PLACE.real).astype(np.complex64), SPACING_MM, inside)
    np.testing.assert_allclose(stretched, 0.02, rtol=1e-3)
    turned = strain((0.02j * PLACE).astype(np.complex64), SPACING_MM, inside)
    np.testing.assert_allclose(turned, 0, atol=1e-5)


@pytest.mark.parametrize("turn_deg", [15.0, 30.0, 45.0, 90.0])
def test_strain_does_not_depend_on_the_axes(turn_deg: float) -> None:
    inside = np.arange(PLACE.size).reshape(SHAPE)[2:-2, 2:-2].ravel()
    turn = np.exp(1j * np.radians(turn_deg))
    # a stretch along one axis and compression across it; at 45° it is pure shear
    stretched = 0.02 * np.conj(PLACE * turn.conj()) * turn
    found = strain(stretched.astype(np.complex64), SPACING_MM, inside)
    np.testing.assert_allclose(found, 0.02 * np.sqrt(2), rtol=1e-3)


@pytest.mark.parametrize("cells", [(48, 64), (480, 640)], ids=["cells", "pixels"])
def test_a_field_is_sampled_in_the_middle_of_each_block(cells: tuple[int, int]) -> None:
    rows, columns = ((np.arange(count) + 0.5) / count for count in cells)
    field = np.stack(np.broadcast_arrays(columns, -rows[:, None]), axis=2).astype(np.float32)
    small = as_complex(coarse(field, (480, 640), stride_of(640)))
    assert small.shape == SHAPE
    at_x, at_y = ((np.arange(4, side, 8) + 0.5) / side for side in (640, 480))
    inner = np.s_[1:-1, 1:-1]
    np.testing.assert_allclose(small[inner], (at_x - 1j * at_y[:, None])[inner], atol=1e-5)
