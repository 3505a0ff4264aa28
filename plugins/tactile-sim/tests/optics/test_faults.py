from typing import Any

import numpy as np
import pytest
from support.virtual_rigs import QUIET, level, rig, shift

from tactile_core.errors import InputError
from tactile_sim.optics import Faults, RigOptics

AROUND = (0.0, 60.0, 120.0, 180.0, 240.0, 300.0)


def frames(count: int, faults: Faults, *, in_turn: bool = True, **more: Any) -> list[np.ndarray]:
    optics = RigOptics(rig(AROUND, in_turn=in_turn, **more), faults=faults, seed=5)
    return [optics.expose(level()) for _ in range(count)]


def test_lights_drift_independently_and_start_without_drift() -> None:
    faults = Faults(drift=0.2, drift_frames=8)
    steady, drifting = (
        np.array(frames(8, f, optics={"sensor": QUIET})).mean((1, 2)) for f in (Faults(), faults)
    )
    course = drifting / steady
    np.testing.assert_allclose(course[0], 1, atol=1e-3)
    assert 0.2 < np.ptp(course, axis=0).max() < 0.5
    assert np.ptp(course[3]) > 0.02


def test_dust_is_fixed_in_the_image() -> None:
    def change(faults: Faults) -> list[np.ndarray]:
        whole, spoilt = (
            RigOptics(rig((0.0, 90.0), optics={"sensor": QUIET}), faults=f, seed=1)
            for f in (Faults(), faults)
        )
        states = ((level(),), (level(), shift(1.0)))
        return [spoilt.expose(*s) / whole.expose(*s) - 1 for s in states]

    rest, moved = change(Faults(dust=10))
    np.testing.assert_allclose(rest, moved, atol=1e-3)
    assert rest.min() < -0.1


@pytest.mark.parametrize(
    ("values", "what"),
    [
        ({"missing_markers": 1.5}, "missing_markers is a share from 0 to 1, not 1.5"),
        ({"dust": -1}, "dust cannot be negative"),
        ({"drift_frames": 0}, "must be positive"),
    ],
)
def test_values_out_of_range_are_refused(values: dict[str, Any], what: str) -> None:
    with pytest.raises(InputError, match=what):
        Faults(**values)


def test_an_unknown_light_is_refused_by_name() -> None:
    with pytest.raises(InputError, match="no light 'led9'; the lights are led0"):
        RigOptics(rig(), faults=Faults(dim_lights={"led9": 0.0}))
