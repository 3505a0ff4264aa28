"""Images with forces: the loads on the cells are the force, and half the size is the same image."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.profiles.loader import load_profile
from tactile_train.virtual_forces import (
    TRAINING_OBJECTS,
    UNSEEN_OBJECTS,
    ForceUnit,
    cell_centres_mm,
    cell_loads,
    halve_profile,
)

SMALL = {"image": {"width_px": 160, "height_px": 120, "mm_per_px": 0.1104}}
VIEW_MM = np.array([17.664, 13.248])


@given(st.integers(1, 30), st.integers(0, 2**32 - 1))
def test_cells_add_up_to_force_and_torque(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = rng.uniform(-10, 10, (2, count))
    forces = rng.normal(size=(3, count))
    loads = cell_loads(places, forces, VIEW_MM, (20, 15)).astype(float)
    x, y = cell_centres_mm(VIEW_MM, (20, 15))
    torque = (x * loads[1] - y[:, None] * loads[0] + loads[3]).sum()
    assert loads[:3].sum((1, 2)) == pytest.approx(forces.sum(1), abs=1e-4)
    assert torque == pytest.approx((places[0] * forces[1] - places[1] * forces[0]).sum(), abs=1e-3)


def test_a_unit_gives_the_same_samples_again() -> None:
    design = load_profile("hex_fingertip", sim=True, overrides=SMALL)
    first, again = (
        list(ForceUnit(design, 7, (80, 56)).samples(TRAINING_OBJECTS, 3)) for _ in range(2)
    )
    for one, other in zip(first, again, strict=True):
        assert np.array_equal(one.pixels, other.pixels)
        assert np.array_equal(one.wrench, other.wrench)
    assert first[0].pixels.shape == (56, 80, 3)
    assert first[0].loads[2].sum() == pytest.approx(first[0].wrench[2], rel=1e-4)
    assert 0 < first[0].wrench[2] <= 20.1


def test_half_the_size_shows_the_same_light_and_noise() -> None:
    design = load_profile("hex_fingertip", sim=True)
    full, half = (ForceUnit(design, 3, (160, 120), half=small) for small in (False, True))
    change = full.reference - half.reference
    assert np.abs(change.mean((0, 1))).max() < 1
    assert change.std() < 2.5
    assert halve_profile(design).image.width_px == 320


def test_unseen_objects_are_not_trained_on() -> None:
    assert len(TRAINING_OBJECTS) == 13
    assert not {one.name for one in TRAINING_OBJECTS} & {one.name for one in UNSEEN_OBJECTS}
    assert [one.name for one in UNSEEN_OBJECTS] == ["sphere 25", "cylinder 22", "flat 11"]
