"""Cues of slip from fields of a contact with known slip."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactile_core.algorithms.slip.cues import Cues
from tactile_core.algorithms.slip.recent_fields import positions_mm
from tactile_core.algorithms.slip.sheared_contact import ContactLoad, ShearedContact

SPACING_MM, SHAPE, RADIUS_MM = 0.22, (60, 80), 4.0
PLACE = positions_mm(SHAPE, SPACING_MM)
CONTACT = np.abs(PLACE) < RADIUS_MM
LOAD = ContactLoad(area=50.0, depth=5.0)


class Sheared:
    """A contact whose object moves in steps; the surface outside the stick region lags behind."""

    def __init__(self, seed: int = 0, noise_mm: float = 0.001, *, blurred: bool = False) -> None:
        self._blurred = blurred
        self.contact = ShearedContact(SPACING_MM)
        self._rng, self._noise_mm = np.random.default_rng(seed), noise_mm
        self._field = np.zeros(SHAPE, np.complex128)
        self.look()

    def move(self, step: complex, stick_mm: float = 99.0, stopped: float = 0.0) -> Cues:
        beyond = np.clip((np.abs(PLACE) - stick_mm) / RADIUS_MM, 0, None)
        self._field = self._field + step * (1 - stopped) / (1 + 6 * beyond)
        return self.look()

    def add(self, field: NDArray[Any], load: ContactLoad = LOAD) -> Cues:
        self._field = self._field + field
        return self.look(load)

    def look(self, load: ContactLoad = LOAD) -> Cues:
        noise = self._rng.normal(0, self._noise_mm, (2, *SHAPE))
        field = (self._field + noise[0] + 1j * noise[1]).astype(np.complex64)
        return self.contact.update(field, CONTACT, load, blurred=self._blurred)


@settings(max_examples=15, deadline=None)
@given(
    st.lists(st.complex_numbers(min_magnitude=0.01, max_magnitude=0.08), min_size=2, max_size=12),
    st.integers(0, 99),
)
def test_the_degree_of_a_sticking_contact_is_small_for_any_motion(
    steps: list[complex], seed: int
) -> None:
    surface = Sheared(seed)
    assert max(surface.move(step).degree for step in steps) < 0.1


def test_an_object_that_stops_while_it_sticks_changes_nothing() -> None:
    surface = Sheared()
    for _ in range(8):
        surface.move(0.04)
    held = [surface.move(0.0) for _ in range(30)]
    assert held[-1].deceleration > 0.8
    assert max(cues.degree for cues in held) < 0.1


def test_the_degree_rises_as_the_stick_region_shrinks_and_most_when_it_stops() -> None:
    surface = Sheared()
    for _ in range(5):
        surface.move(0.04)
    degrees = [surface.move(0.04, stick_mm).degree for stick_mm in np.linspace(4, 0.5, 15)]
    assert np.all(np.diff(degrees[::3]) > 0)
    stopping = [surface.move(0.04, 0.5, stopped=1.0).degree for _ in range(3)]
    assert stopping[-1] > max(degrees)
    assert stopping[-1] > 0.7


def test_the_spread_under_a_growing_load_is_not_shear() -> None:
    surface = Sheared()
    for number in range(1, 6):
        cues = surface.add(0.01 * PLACE, ContactLoad(50.0, 5.0 * 1.3**number))
    assert cues == Cues(entropy_bits=pytest.approx(0, abs=1e-9), motion_mm=0.0)


def test_the_rotation_has_the_right_sign() -> None:
    surface = Sheared()
    for _ in range(10):
        cues = surface.add((1 - np.exp(0.01j)) * PLACE)
    assert cues.rotation_rad == pytest.approx(-0.1, rel=0.05)
    assert cues.rotation_mm == pytest.approx(cues.motion_mm, rel=0.05)


def test_a_rotation_that_is_blurred_at_the_border_is_not_slip() -> None:
    rounded = (1 - np.exp(0.012j)) * PLACE * np.clip(1.75 - np.abs(PLACE) / RADIUS_MM, 0.75, 1)
    sharp, blurred = Sheared(), Sheared(blurred=True)
    for _ in range(12):
        strict, tolerant = sharp.add(rounded), blurred.add(rounded)
    assert tolerant.degree < 0.15 < strict.degree


def test_blur_does_not_change_the_stick_share_of_a_shift() -> None:
    sharp, blurred = Sheared(), Sheared(blurred=True)
    for _ in range(12):
        strict, tolerant = sharp.move(0.03, stick_mm=2.0), blurred.move(0.03, stick_mm=2.0)
    assert tolerant.stick_share == pytest.approx(strict.stick_share, abs=0.02)


def test_entropy_is_small_for_uniform_motion_and_grows_with_the_lag() -> None:
    surface = Sheared()
    uniform = [surface.move(0.04) for _ in range(6)][-1].entropy_bits
    lagging = [surface.move(0.04, 1.0) for _ in range(6)][-1].entropy_bits
    assert uniform < 1.6
    assert lagging > uniform + 2


def test_a_contact_of_a_few_points_gives_no_cues() -> None:
    contact = ShearedContact(SPACING_MM)
    tiny = np.abs(PLACE) < 0.3
    field = np.full(SHAPE, 0.1, np.complex64)
    assert contact.update(field, tiny, LOAD) == Cues()
