"""The least force of a virtual sensor."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tactile_core.evaluation.floor import virtual
from tactile_core.interfaces.sink import Reading
from tactile_core.profiles.loader import load_profile
from tactile_core.sim.stage import VirtualStage

SMALL = {
    "image": {"width_px": 160, "height_px": 120, "mm_per_px": 0.1104},
    "estimators": {
        **dict.fromkeys(load_profile("hex_fingertip_unmarked").estimators),
        "load": {"use": "core.load"},
    },
}
NOISE_N = 0.001


@pytest.fixture(autouse=True)
def _few_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    few = {"rest_frames": 12, "averaged": 3, "shears": 3, "shear_mm": 0.02}
    for name, value in {**few, "forces_n": (0.1, 0.4, 0.8)}.items():
        monkeypatch.setattr(virtual.VIRTUAL_FLOOR, name, value)
    ball = ("sphere", {"diameter_mm": 12})
    monkeypatch.setattr(virtual, "_OBJECTS", {"ball": ball})


def test_a_sensor_without_calibration_is_evaluated_by_its_load() -> None:
    profile = load_profile("hex_fingertip_unmarked", sim=True, overrides=SMALL)
    (floor,) = virtual.virtual_floors(profile)
    assert (floor.estimate, floor.object, floor.rest_frames) == ("load", "ball", 12)
    assert floor.least_n is not None
    assert floor.least_n <= 0.41
    assert floor.slope_per_n is not None
    assert floor.slope_per_n > 0


def test_shear_is_judged_against_a_contact_without_shear(monkeypatch: pytest.MonkeyPatch) -> None:
    stages: list[VirtualStage] = []
    rng = np.random.default_rng(0)

    class Noted(VirtualStage):
        def __init__(self, *given: Any) -> None:
            super().__init__(*given)
            stages.append(self)

    def truth(_: Reading) -> dict[str, float]:
        noisy = stages[0].truth().wrench + rng.normal(0, NOISE_N, 4)
        return {name: float(noisy[axis]) for axis, name in enumerate(("fx", "fy", "fz"))}

    monkeypatch.setattr(virtual, "VirtualStage", Noted)
    monkeypatch.setattr(virtual, "estimates", truth)
    profile = load_profile("hex_fingertip_unmarked", sim=True, overrides=SMALL)
    floors = {floor.estimate: floor for floor in virtual.virtual_floors(profile)}
    assert list(floors) == ["fz", "fx", "fy"]
    for floor in floors.values():
        assert floor.rest_limit < 5 * NOISE_N
        assert floor.slope_per_n == pytest.approx(1, abs=0.1)
        assert floor.least_n is not None
        assert floor.least_n > floor.rest_limit
