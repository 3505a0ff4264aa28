"""Slip under an object that is wider than the view."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.algorithms.slip.cues import Cues
from tactile_core.algorithms.slip.recent_fields import positions_mm
from tactile_core.algorithms.slip.sheared_contact import ContactLoad, ShearedContact
from tactile_core.algorithms.slip.stick_region import (
    fills_view,
    smooth_displacement,
    smoothed_std_mm,
)

SPACING_MM, SHAPE = 0.22, (60, 80)
PLACE = positions_mm(SHAPE, SPACING_MM)
VIEW = np.ones(SHAPE, np.bool_)
HALF_WIDTH_MM = float(PLACE.real.max())


def sheared(lag: float, frames: int = 12, *, wide: bool = True) -> Cues:
    """A plate whose surface sticks in the middle and lags by this share at both sides."""
    contact = ShearedContact(SPACING_MM)
    beyond = np.clip(np.abs(PLACE.real) / HALF_WIDTH_MM - 0.3, 0, None) / 0.7
    rng = np.random.default_rng(0)
    for number in range(frames):
        noise = rng.normal(0, 0.001, (2, *SHAPE))
        field = 0.04 * number * (1 - lag * beyond) + noise[0] + 1j * noise[1]
        cues = contact.update(field.astype(np.complex64), VIEW, ContactLoad(50.0, 5.0), wide=wide)
    return cues


def test_a_small_lag_is_slip_only_where_no_border_is_in_view() -> None:
    assert sheared(0.0).degree < 0.1
    assert sheared(0.12).degree > 0.5
    assert sheared(0.12, wide=False).degree < 0.1


def test_an_object_that_stops_and_returns_does_not_slip() -> None:
    contact = ShearedContact(SPACING_MM)
    steps = [0.05] * 6 + [0.0] * 6 + [-0.05] * 6
    for moved in np.cumsum([0.0, *steps]):
        field = np.full(SHAPE, moved, np.complex64)
        cues = contact.update(field, VIEW, ContactLoad(50.0, 5.0), wide=True)
        assert cues.degree < 0.1


def test_a_surface_that_stops_at_once_while_it_lags_slips() -> None:
    contact = ShearedContact(SPACING_MM)
    beyond = np.abs(PLACE.real) / HALF_WIDTH_MM
    fields = [0.2 * number * np.ones(SHAPE) for number in range(6)]
    fields += [fields[-1] + 0.2 * (1 - beyond), fields[-1] + 0.21 * (1 - beyond)]
    for field in fields:
        cues = contact.update(field.astype(np.complex64), VIEW, ContactLoad(50.0, 5.0), wide=True)
    assert cues.degree > 0.9


def test_a_slow_bend_survives_smoothing_and_noise_does_not() -> None:
    at = PLACE.ravel()[::7].astype(np.complex64)
    bend = (0.1 + 0.02 * at.real + 0.003j * at.imag**2).astype(np.complex64)
    assert smooth_displacement(bend, at) == pytest.approx(bend, abs=1e-5)
    rng = np.random.default_rng(1)
    noise = (rng.normal(0, 0.01, at.shape) + 1j * rng.normal(0, 0.01, at.shape)).astype(
        np.complex64
    )
    left = smooth_displacement(bend + noise, at) - bend
    assert np.sqrt(np.mean(left.real**2)) < 2 * 0.01 * np.sqrt(10 / len(at))


def test_more_markers_leave_less_noise() -> None:
    assert smoothed_std_mm(0.007, 768) == pytest.approx(smoothed_std_mm(0.007, 192) / 2)
    assert smoothed_std_mm(0.007, None) == smoothed_std_mm(0.007, 192)


def test_a_contact_that_leaves_the_view_on_all_sides_fills_it() -> None:
    assert fills_view(VIEW)
    assert not fills_view(np.abs(PLACE.imag) < 3)
    assert not fills_view(np.abs(PLACE) < 4)
