"""A loaded object moves until friction holds it, or to the table."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core import load_profile
from tactile_core.errors import InputError
from tactile_sim.gel_surface import GelSurface
from tactile_sim.indenters import make_indenter
from tactile_sim.normal_contact import balance_load

GRIP_N, FRICTION = 4.0, 0.5


def gripped(**gel: float) -> GelSurface:
    """A cylinder pressed by a force, with Coulomb friction."""
    law = {"friction": FRICTION, "friction_speed_mm_s": None} | gel
    surface = GelSurface(load_profile("hex_fingertip", overrides={"gel": law}), "fast")
    surface.indent_with(make_indenter("cylinder", diameter_mm=20.0, length_mm=10.0))
    surface.press(force_n=GRIP_N)
    return surface


@pytest.mark.parametrize("load_n", [0.2, 3.0, -1.5])
def test_a_spring_balances_the_load(load_n: float) -> None:
    def force_n(travel_mm: float) -> float:
        return 2.0 * travel_mm + (4.0 if load_n < 0 else 0.0)

    wanted = abs(load_n)
    travel = balance_load(force_n, wanted, first_mm=0.01, at_most_mm=10.0)
    assert force_n(travel) == pytest.approx(wanted, rel=0.01)


def test_a_load_that_nothing_holds_goes_as_far_as_it_can() -> None:
    assert balance_load(lambda travel: min(travel, 0.5), 1.0, first_mm=0.1, at_most_mm=3.0) == 3.0
    assert balance_load(lambda travel: min(travel, 0.5), 1.0, first_mm=0.1, at_most_mm=0.0) == 0.0


def test_friction_carries_a_load_below_its_limit() -> None:
    surface = gripped()
    surface.pull(0.0, 1.0, at_most_mm=5.0)
    np.testing.assert_allclose(surface.wrench[:3], [0.0, 1.0, GRIP_N], atol=0.02)
    assert surface.state.pose.y_mm < 0.3
    surface.pull(0.0, 0.5, at_most_mm=0.0)  # a smaller load lets the gel spring back
    assert surface.wrench[1] == pytest.approx(0.5, abs=0.01)


def test_a_load_above_the_limit_slips_to_the_table() -> None:
    surface = gripped()
    surface.pull(1.2 * FRICTION * GRIP_N, 0.0, at_most_mm=2.0)
    assert surface.state.pose.x_mm == pytest.approx(2.0)
    assert surface.wrench[0] == pytest.approx(FRICTION * GRIP_N, rel=0.01)
    assert not surface.state.stick.any()


def test_kinetic_friction_lets_go_below_the_static_limit() -> None:
    surface = gripped(kinetic_friction=0.3)
    forces = []
    for _ in range(12):
        surface.shear(dy_mm=0.05)
        forces.append(surface.wrench[1])
    assert forces[-1] == pytest.approx(0.3 * GRIP_N, rel=0.01)
    assert not surface.state.stick.any()
    assert max(forces) <= FRICTION * GRIP_N


@pytest.mark.parametrize(
    ("load", "at_most_mm", "message"),
    [((0.0, 0.0), 1.0, "above 0"), ((1.0, 0.0), -1.0, "0 or more, not -1")],
)
def test_an_impossible_load_is_refused(
    load: tuple[float, float], at_most_mm: float, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        gripped().pull(*load, at_most_mm=at_most_mm)
