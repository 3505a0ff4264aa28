"""Shape of an undeformed domed gel."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.heights.sphere import flat_equivalent, rest_height


@given(st.floats(8, 1000), st.integers(2, 40), st.integers(2, 40))
def test_every_undeformed_point_is_on_the_sphere(radius: float, rows: int, columns: int) -> None:
    z = rest_height((rows, columns), mm_per_px=0.2, radius_mm=radius).astype(float)
    y, x = np.mgrid[:rows, :columns] * 0.2
    from_centre = np.sqrt((x - x.mean()) ** 2 + (y - y.mean()) ** 2 + (z + radius) ** 2)
    np.testing.assert_allclose(from_centre, radius, rtol=1e-6)


def test_the_apex_is_at_the_image_centre_and_the_border_nearer_to_the_camera() -> None:
    z = rest_height((31, 41), mm_per_px=0.1, radius_mm=10)
    assert z[15, 20] == z.max() == 0
    assert z[0, 0] == z.min() < 0
    np.testing.assert_array_equal(z, z[::-1, ::-1])


def test_beyond_its_equator_a_dome_stays_finite() -> None:
    assert rest_height((11, 11), mm_per_px=1, radius_mm=3)[0, 0] == -3


def test_a_dome_of_infinite_radius_is_flat() -> None:
    assert flat_equivalent(2.0, None) == 2.0
    assert flat_equivalent(2.0, 1e9) == pytest.approx(2.0)
    # two equal spheres touch like one of half the radius on a plane
    assert flat_equivalent(2.0, 2.0) == 1.0
