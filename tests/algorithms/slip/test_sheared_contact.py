"""One contact over time, on fields whose slip is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactile_core.algorithms.slip.cues import Cues
from tactile_core.algorithms.slip.plane import places_mm
from tactile_core.algorithms.slip.sheared_contact import Load, ShearedContact

SPACING_MM, SHAPE, RADIUS_MM = 0.22, (60, 80), 4.0
PLACE = places_mm(SHAPE, SPACING_MM)
CONTACT = np.abs(PLACE) < RADIUS_MM
LOAD = Load(area=50.0, depth=5.0)


class Sheared:
    """A contact whose object moves in steps; skin beyond a core follows less."""

    def __init__(self, seed: int = 0, noise_mm: float = 0.001, *, blurred: bool = False) -> None:
        self._blurred = blurred
        self.contact = ShearedContact(SPACING_MM)
        self._rng, self._noise_mm = np.random.default_rng(seed), noise_mm
        self._field = np.zeros(SHAPE, np.complex128)
        self.look()

    def move(self, step: complex, core_mm: float = 99.0, halted: float = 0.0) -> Cues:
        beyond = np.clip((np.abs(PLACE) - core_mm) / RADIUS_MM, 0, None)
        self._field = self._field + step * (1 - halted) / (1 + 6 * beyond)
        return self.look()

    def add(self, field: NDArray[Any], load: Load = LOAD) -> Cues:
        self._field = self._field + field
        return self.look(load)

    def look(self, load: Load = LOAD) -> Cues:
        noise = self._rng.normal(0, self._noise_mm, (2, *SHAPE))
        field = (self._field + noise[0] + 1j * noise[1]).astype(np.complex64)
        return self.contact.update(field, CONTACT, load, blurred=self._blurred)


@settings(max_examples=15, deadline=None)
@given(
    st.lists(st.complex_numbers(min_magnitude=0.01, max_magnitude=0.08), min_size=2, max_size=12),
    st.integers(0, 99),
)
def test_a_contact_that_follows_however_the_object_moves_has_no_degree(
    steps: list[complex], seed: int
) -> None:
    surface = Sheared(seed)
    assert max(surface.move(step).degree for step in steps) < 0.1


def test_an_object_that_stops_while_it_is_held_well_changes_nothing() -> None:
    surface = Sheared()
    for _ in range(8):
        surface.move(0.04)
    held = [surface.move(0.0) for _ in range(30)]
    assert held[-1].stalled > 0.8
    assert max(cues.degree for cues in held) < 0.1


def test_the_degree_rises_while_the_core_shrinks_and_most_when_it_stops() -> None:
    surface = Sheared()
    for _ in range(5):
        surface.move(0.04)
    degrees = [surface.move(0.04, core_mm).degree for core_mm in np.linspace(4, 0.5, 15)]
    assert np.all(np.diff(degrees[::3]) > 0)
    halting = [surface.move(0.04, 0.5, halted=1.0).degree for _ in range(3)]
    assert halting[-1] > max(degrees)
    assert halting[-1] > 0.7


def test_what_a_growing_load_spreads_is_no_shear() -> None:
    surface = Sheared()
    for number in range(1, 6):
        cues = surface.add(0.01 * PLACE, Load(50.0, 5.0 * 1.3**number))
    assert cues == Cues(entropy_bits=pytest.approx(0, abs=1e-9), motion_mm=0.0)


def test_the_turn_of_the_contact_is_reported_with_its_sign() -> None:
    surface = Sheared()
    for _ in range(10):
        cues = surface.add((1 - np.exp(0.01j)) * PLACE)
    assert cues.turn_rad == pytest.approx(-0.1, rel=0.05)
    assert cues.turned_mm == pytest.approx(cues.motion_mm, rel=0.05)


def test_a_turn_that_the_field_rounds_off_at_the_border_is_no_slip() -> None:
    rounded = (1 - np.exp(0.012j)) * PLACE * np.clip(1.75 - np.abs(PLACE) / RADIUS_MM, 0.75, 1)
    sharp, blurred = Sheared(), Sheared(blurred=True)
    for _ in range(12):
        told, doubted = sharp.add(rounded), blurred.add(rounded)
    assert doubted.degree < 0.15 < told.degree


def test_a_shift_is_judged_alike_whether_the_field_knows_the_border_or_not() -> None:
    sharp, blurred = Sheared(), Sheared(blurred=True)
    for _ in range(12):
        told, doubted = sharp.move(0.03, core_mm=2.0), blurred.move(0.03, core_mm=2.0)
    assert doubted.following == pytest.approx(told.following, abs=0.02)


def test_entropy_is_small_while_all_moves_alike_and_grows_with_the_lag() -> None:
    surface = Sheared()
    alike = [surface.move(0.04) for _ in range(6)][-1].entropy_bits
    lagging = [surface.move(0.04, 1.0) for _ in range(6)][-1].entropy_bits
    assert alike < 1.6
    assert lagging > alike + 2


def test_a_contact_of_a_few_places_tells_nothing() -> None:
    contact = ShearedContact(SPACING_MM)
    tiny = np.abs(PLACE) < 0.3
    field = np.full(SHAPE, 0.1, np.complex64)
    assert contact.update(field, tiny, LOAD) == Cues()
