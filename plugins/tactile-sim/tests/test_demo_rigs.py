"""Rigs are demonstrated in several processes as in one."""

from __future__ import annotations

import pytest

from tactile_core.errors import TactileError
from tactile_core.interfaces.calibration import Silent
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_sim.demonstration import demonstrate_rigs


class Shares(Silent):
    """Completed fractions that were reported."""

    def __init__(self) -> None:
        self.reported: list[float] = []

    def fraction(self, done: float) -> None:
        self.reported.append(done)


def small(name: str) -> Profile:
    """A shipped rig at a third of its resolution."""
    profile = load_profile(name)
    image = profile.image
    size = {
        "width_px": image.width_px // 3,
        "height_px": image.height_px // 3,
        "mm_per_px": 3 * image.mm_per_px,
    }
    return profile.model_copy(update={"image": image.model_copy(update=size)})


def test_two_processes_give_the_results_of_one() -> None:
    first = small("baxter_fingertip")
    profiles = [first, first.model_copy(update={"description": "another"})]
    shares = Shares()
    found = demonstrate_rigs(profiles, shares, processes=2)
    assert found[:1] == demonstrate_rigs(profiles[:1], Silent(), processes=1)
    for profile, (rows, parts) in zip(profiles, found, strict=True):
        assert rows == found[0][0]
        assert profile.description in parts[0]
    assert shares.reported == sorted(shares.reported)
    assert shares.reported[-1] == 1


def test_a_rig_that_fails_ends_the_demonstration() -> None:
    whole = small("baxter_fingertip")
    # no light falls on the gel: its presses cannot be found
    dark = whole.model_copy(
        update={
            "optics": whole.optics.model_copy(
                update={"sensor": whole.optics.sensor.model_copy(update={"exposure": 1e-6})}
            )
        }
    )
    with pytest.raises(TactileError):
        demonstrate_rigs([dark, whole], Silent(), processes=2)
