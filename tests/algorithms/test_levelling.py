"""Heights relative to the undeformed surface: analytic surfaces of known error."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_core.algorithms.levelling import set_to_rest

SHAPE, MM_PER_PX = (120, 160), 0.1
Y, X = np.indices(SHAPE) * MM_PER_PX
DOME = 0.5 * np.maximum(1 - ((X - 8) ** 2 + (Y - 6) ** 2) / 1.5**2, 0)
WAVE = 0.02 * np.cos(X / 2.9 + 0.4) * np.cos(Y / 2.3 - 0.3)


def at_rest(height: NDArray[np.float64], **options: float) -> NDArray[np.float32]:
    """Set a surface to rest whose slopes are exact."""
    gy, gx = (g.astype(np.float32) for g in np.gradient(height, MM_PER_PX))
    found = height.astype(np.float32)
    set_to_rest(found, gx, gy, mm_per_px=MM_PER_PX, **options)  # type: ignore[arg-type]
    return found


@pytest.mark.parametrize("levelled", [True, False])
def test_level_and_drift_vanish_and_the_contact_keeps_its_height(levelled: bool) -> None:
    found = at_rest(DOME + 3 + 0.02 * X - 0.01 * Y, levelled=levelled)
    np.testing.assert_allclose(found, DOME, atol=0.01)


def test_a_tilt_too_steep_for_drift_stays() -> None:
    found = at_rest(DOME + 0.02 * X, drift_slope=0.0, levelled=False)
    np.testing.assert_allclose(np.diff(found - DOME, axis=1), 0.02 * MM_PER_PX, atol=1e-5)


def test_a_smooth_error_stays_unless_it_is_levelled() -> None:
    assert at_rest(WAVE).std() < 0.6 * at_rest(WAVE, levelled=False).std()


def test_an_error_vanishes_over_a_length_in_proportion_to_the_thickness() -> None:
    left = [at_rest(WAVE, thickness_mm=thickness).std() for thickness in (1.0, 2.0, 4.0)]
    assert left[0] < 0.6 * left[1] < 0.6 * left[2]
