from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from support.virtual_rigs import QUIET, SHAPE, bump, level, rig, shift

from tactile_core.algorithms.sequence import faults as found_faults
from tactile_core.algorithms.sequence import pattern
from tactile_core.errors import InputError
from tactile_core.sim.optics import Faults, RigOptics

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


def test_dust_is_fixed_in_the_image_and_scratches_move_with_the_gel() -> None:
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
    rest, moved = change(Faults(scratches=6))
    assert np.corrcoef(rest[:, 20:130].ravel(), moved[:, 30:140].ravel())[0, 1] > 0.9


def test_a_dropped_frame_shows_the_one_before_and_a_torn_one_part_of_it() -> None:
    pressed = RigOptics(rig(), faults=Faults(dropped_frames=0.5), seed=2)
    seen = [pressed.expose(bump(0.02 * k)) for k in range(20)]
    again = [bool((a == b).all()) for a, b in pairwise(seen)]
    assert 4 <= sum(again) <= 15
    torn = RigOptics(rig(), faults=Faults(torn_frames=1.0), seed=2)
    before, after = torn.expose(level()), torn.expose(bump())
    kept = (before == after).all((1, 2))
    assert 0 < np.argmax(kept) < SHAPE[0]
    assert kept[np.argmax(kept) :].all()


def test_late_lights_are_detected_from_their_images() -> None:
    usual = frames(1, Faults())[0]
    late = frames(1, Faults(slipped_frames=1.0))[0]
    full_scale = 2.0**16 - 1
    assert found_faults(pattern(usual, full_scale), None) == ()
    faults = found_faults(pattern(late, full_scale), pattern(usual, full_scale))
    assert [fault.shows for fault in faults] == [5, 0, 1, 2, 3, 4]


def test_overexposure_saturates() -> None:
    (frame,) = frames(1, Faults(overexposure=4.0))
    assert (frame == 2**16 - 1).mean() > 0.5


@pytest.mark.parametrize(
    ("values", "what"),
    [
        ({"torn_frames": 1.5}, "torn_frames is a share from 0 to 1, not 1.5"),
        ({"dust": -1}, "dust cannot be negative"),
        ({"overexposure": 0}, "must be positive"),
    ],
)
def test_values_out_of_range_are_refused(values: dict[str, Any], what: str) -> None:
    with pytest.raises(InputError, match=what):
        Faults(**values)


def test_an_unknown_light_is_refused_by_name() -> None:
    with pytest.raises(InputError, match="no light 'led9'; the lights are led0"):
        RigOptics(rig(), faults=Faults(dim_lights={"led9": 0.0}))


def test_an_unknown_led_is_refused() -> None:
    profile = rig(optics={"lights": {"array": [1, 4]}})
    with pytest.raises(InputError, match="light 'led0' has LEDs 0 to 3, and dead_leds names 1, 4"):
        RigOptics(profile, faults=Faults(dead_leds={"led0": (1, 4)}))
