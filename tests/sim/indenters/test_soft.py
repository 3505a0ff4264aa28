"""Soft objects share the deformation with the gel."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tactile_core import load_profile
from tactile_core.algorithms.elasticity import POISSON_RATIO, SHEAR_MODULUS_MPA
from tactile_core.errors import InputError
from tactile_core.sim.gel_surface import GelSurface
from tactile_core.sim.indenters import make_indenter

LIKE_THE_GEL = {
    "shear_modulus_mpa": SHEAR_MODULUS_MPA,
    "thickness_mm": 2.0,
    "poisson_ratio": POISSON_RATIO,
}


def pressed(soft: dict[str, float] | None, *, friction: float = 0.5, **load: Any) -> GelSurface:
    """A ball on a gel of 2 mm without size, crown or viscosity."""
    profile = load_profile("desktop_three_colour", overrides={"gel": {"friction": friction}})
    surface = GelSurface(profile, "fast")
    surface.indent_with(make_indenter("sphere", diameter_mm=16.0, soft=soft))
    surface.press(**(load or {"depth_mm": 0.4}))
    return surface


def test_an_object_as_soft_as_the_gel_takes_half_of_the_depth() -> None:
    surface = pressed(LIKE_THE_GEL, friction=0.0)
    # the deepest node is half a node from the ball's lowest point
    assert surface.truth().height_mm.max() == pytest.approx(0.2, rel=0.03)
    assert surface.force_n < 0.6 * pressed(None, friction=0.0).force_n


def test_a_stiff_layer_is_as_good_as_rigid() -> None:
    stiff = pressed({"shear_modulus_mpa": 1e4, "thickness_mm": 1.0})
    rigid = pressed(None)
    for surface in (stiff, rigid):
        surface.shear(dx_mm=0.2, steps=2)
    np.testing.assert_allclose(stiff.wrench, rigid.wrench, rtol=2e-3, atol=2e-3)


def test_a_soft_object_has_a_larger_contact_and_shears_less_stiffly() -> None:
    soft, rigid = pressed(LIKE_THE_GEL, force_n=3.0), pressed(None, force_n=3.0)
    assert soft.state.contact.sum() > 1.2 * rigid.state.contact.sum()
    for surface in (soft, rigid):
        surface.shear(dx_mm=0.05)
    assert 0.3 * rigid.wrench[0] < soft.wrench[0] < 0.9 * rigid.wrench[0]


def test_a_soft_object_that_slides_has_coulombs_force() -> None:
    surface = pressed(LIKE_THE_GEL, force_n=3.0)
    surface.shear(dx_mm=2.0, steps=20)
    assert surface.wrench[0] == pytest.approx(0.5 * 3.0, rel=0.02)
    assert not surface.truth().stick.any()


@pytest.mark.parametrize(
    ("soft", "message"),
    [
        ({"thickness_mm": 2.0}, "a soft object needs shear_modulus_mpa"),
        (LIKE_THE_GEL | {"poisson_ratio": 0.5}, "between 0 and 0.5"),
        (LIKE_THE_GEL | {"thickness_mm": -1.0}, "above 0"),
    ],
)
def test_an_impossible_layer_is_refused(soft: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make_indenter("sphere", diameter_mm=8.0, soft=soft)
