"""The shear of contacts, and of rigid motions, for which it is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactile_core.algorithms.slip.plane import positions_mm
from tactile_core.algorithms.slip.shear_field import (
    ContactLoad,
    MeasuredShear,
    RigidMotion,
    ShearedContact,
    fit_rigid_motion,
    guess_sticking,
)

SPACING_MM, SHAPE, RADIUS_MM = 0.22, (60, 80), 4.0
PLACE = positions_mm(SHAPE, SPACING_MM)
CONTACT = np.abs(PLACE) < RADIUS_MM
LOAD = ContactLoad(area=50.0, depth=5.0)


class Sheared:
    """A contact whose object moves in steps; the surface outside the stick region lags behind."""

    def __init__(self, seed: int = 0, noise_mm: float = 0.001) -> None:
        self.contact = ShearedContact(SPACING_MM)
        self._rng, self._noise_mm = np.random.default_rng(seed), noise_mm
        self._field = np.zeros(SHAPE, np.complex128)
        self.look()

    def move(self, step: complex, stick_mm: float = 99.0, stopped: float = 0.0) -> MeasuredShear:
        beyond = np.clip((np.abs(PLACE) - stick_mm) / RADIUS_MM, 0, None)
        self._field = self._field + step * (1 - stopped) / (1 + 6 * beyond)
        return self.look()

    def add(self, field: NDArray[Any], load: ContactLoad = LOAD) -> MeasuredShear:
        self._field = self._field + field
        return self.look(load)

    def look(self, load: ContactLoad = LOAD) -> MeasuredShear:
        noise = self._rng.normal(0, self._noise_mm, (2, *SHAPE))
        field = (self._field + noise[0] + 1j * noise[1]).astype(np.complex64)
        return self.contact.update(field, CONTACT, load)


@settings(max_examples=15, deadline=None)
@given(
    st.lists(st.complex_numbers(min_magnitude=0.01, max_magnitude=0.08), min_size=2, max_size=12),
    st.integers(0, 99),
)
def test_the_degree_of_a_sticking_contact_is_small_for_any_motion(
    steps: list[complex], seed: int
) -> None:
    surface = Sheared(seed)
    assert min(surface.move(step).stick_share for step in steps) > 0.9


def test_an_object_that_stops_while_it_sticks_changes_nothing() -> None:
    surface = Sheared()
    for _ in range(8):
        surface.move(0.04)
    assert min(surface.move(0.0).stick_share for _ in range(30)) > 0.9


def test_the_stick_share_falls_as_the_stick_region_shrinks() -> None:
    surface = Sheared()
    for _ in range(5):
        surface.move(0.04)
    shares = [surface.move(0.04, stick_mm).stick_share for stick_mm in np.linspace(4, 0.5, 15)]
    assert np.all(np.diff(shares[::3]) < 0)
    assert shares[-1] < 0.2


def test_the_spread_under_a_growing_load_is_not_shear() -> None:
    surface = Sheared()
    for number in range(1, 6):
        shear = surface.add(0.01 * PLACE, ContactLoad(50.0, 5.0 * 1.3**number))
    assert shear.stick_share == 1


@pytest.mark.parametrize("grown", [ContactLoad(50.0, 9.0), ContactLoad(90.0, 5.0)])
def test_a_load_that_grows_in_area_or_in_depth_starts_the_shear_again(grown: ContactLoad) -> None:
    surface = Sheared()
    assert [surface.move(0.04) for _ in range(3)][-1].motion_mm > 0.1
    assert surface.look(grown).motion_mm < 0.005


def test_the_rotation_has_the_right_sign() -> None:
    surface = Sheared()
    for _ in range(10):
        shear = surface.add((1 - np.exp(0.01j)) * PLACE)
    assert shear.rotation_rad == pytest.approx(-0.1, rel=0.05)
    assert shear.rotation_mm == pytest.approx(shear.motion_mm, rel=0.05)


def test_entropy_is_small_for_uniform_motion_and_grows_with_the_lag() -> None:
    surface = Sheared()
    uniform = [surface.move(0.04) for _ in range(6)][-1].entropy_bits
    lagging = [surface.move(0.04, 1.0) for _ in range(6)][-1].entropy_bits
    assert uniform < 1.6
    assert lagging > uniform + 2


def test_a_contact_of_a_few_points_has_no_shear() -> None:
    contact = ShearedContact(SPACING_MM)
    tiny = np.abs(PLACE) < 0.3
    field = np.full(SHAPE, 0.1, np.complex64)
    assert contact.update(field, tiny, LOAD) == MeasuredShear()


def _fit_motion(displacement: NDArray[Any]) -> RigidMotion:
    moved = displacement.astype(np.complex64)[CONTACT]
    return fit_rigid_motion(moved, PLACE[CONTACT], guess_sticking(moved, PLACE[CONTACT]), 0.003)


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
    region = _fit_motion(shift + _turned(angle_rad, about))
    assert region.rotation_rad == pytest.approx(angle_rad, abs=1e-3)
    assert (region.lag_mm < 0.01).all()
    assert region.lag_mm.max() < 1e-4


@pytest.mark.parametrize("stick_radius_mm", [1.5, 2.5, 3.5])
@pytest.mark.parametrize("direction", [1, 1j, np.exp(2j)])
def test_the_stick_region_is_found_inside_a_slipping_border(
    stick_radius_mm: float, direction: complex
) -> None:
    field = _partly_slipping(np.full(SHAPE, 0.4 * direction), stick_radius_mm)
    region = _fit_motion(field)
    assert region.shift_mm == pytest.approx(0.4 * direction, rel=0.02)
    assert np.mean(region.lag_mm < 0.01) == pytest.approx(
        (stick_radius_mm / RADIUS_MM) ** 2, abs=0.1
    )


@pytest.mark.parametrize("stick_radius_mm", [2.5, 3.0, 3.5])
def test_the_rotation_is_that_of_the_stick_region(stick_radius_mm: float) -> None:
    region = _fit_motion(_partly_slipping(_turned(0.08, 0), stick_radius_mm))
    assert region.rotation_rad == pytest.approx(0.08, rel=0.03)
    assert region.rotation_mm == pytest.approx(region.motion_mm, rel=0.02)
