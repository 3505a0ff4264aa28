"""Forces of a turned and displaced load cell, in the axes of the image."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.calibration.force.fitting import align_forces
from tactile_core.interfaces.estimator import ForceSamples
from tactile_core.quantities import Wrench

NAMES = ("shift_x", "shift_y", "moment")


def sequences(*, turned: bool, measured: int = 4) -> tuple[list[ForceSamples], list[np.ndarray]]:
    """Samples of a cell that is turned by 90° and 3 mm beside the image centre."""
    rng = np.random.default_rng(0)
    found, true = [], []
    for number in range(3):
        force = rng.normal(size=(20, 4))
        features = np.stack([force[:, 0] / 15, force[:, 1] / 15, force[:, 3] / 8], 1)
        cell = force.copy()
        if turned:
            cell[:, 3] = [Wrench(*one).about((3.0, 0.0)).tz_nmm for one in force]
            cell[:, :2] = np.stack([force[:, 1], -force[:, 0]], 1)
        cell[:, measured:] = np.nan
        found.append(ForceSamples(str(number), features, cell))
        true.append(force)
    return found, true


def test_forces_of_a_turned_cell_become_those_of_the_image() -> None:
    given, true = sequences(turned=True)
    found = align_forces(given, NAMES)
    assert found.rotation is not None
    assert abs(found.rotation.degrees) == pytest.approx(90)
    assert found.offset is not None
    assert found.offset.mm == pytest.approx((3, 0), abs=1e-6)
    for one, force in zip(found.sequences, true, strict=True):
        assert one.forces == pytest.approx(force, abs=1e-6)


def test_forces_of_a_cell_in_place_stay() -> None:
    given, true = sequences(turned=False)
    for one, force in zip(align_forces(given, NAMES).sequences, true, strict=True):
        assert one.forces == pytest.approx(force, abs=1e-6)


def test_without_torque_only_the_rotation_is_found() -> None:
    found = align_forces(sequences(turned=True, measured=3)[0], NAMES)
    assert found.rotation is not None
    assert found.offset is None


@pytest.mark.parametrize(("names", "measured"), [((), 4), (("a", "b", "c"), 4), (NAMES, 1)])
def test_what_is_not_known_is_not_turned(names: tuple[str, ...], measured: int) -> None:
    given = sequences(turned=True, measured=measured)[0]
    found = align_forces(given, names)
    assert found.rotation is None
    assert found.offset is None
    for one, before in zip(found.sequences, given, strict=True):
        np.testing.assert_array_equal(one.forces, before.forces)
