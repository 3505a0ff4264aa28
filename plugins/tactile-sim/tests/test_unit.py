"""Units of one design differ in everything that a measurement must not rely on."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core import load_profile
from tactile_core.profiles.model import Profile
from tactile_sim import VirtualStage
from tactile_sim.stage import vary

DESIGN = load_profile("hex_fingertip", sim=True)


@pytest.mark.parametrize("name", ["hex_fingertip", "baxter_fingertip", "desktop_six_led"])
def test_every_unit_is_a_valid_sensor_of_the_design(name: str) -> None:
    design = load_profile(name, sim=True)
    for seed in range(20):
        unit = vary(design, seed)
        assert unit.image == design.image
        Profile.model_validate(unit.model_dump(by_alias=True))


def test_the_same_seed_is_the_same_unit() -> None:
    assert vary(DESIGN, 3) == vary(DESIGN, 3)
    assert vary(DESIGN, 3) != vary(DESIGN, 4)


def test_deviations_are_bounded_and_centred_on_the_design() -> None:
    units = [vary(DESIGN, seed) for seed in range(200)]
    azimuths = np.array(
        [[light["azimuth_deg"] for light in unit.illumination.options["lights"]] for unit in units]
    )
    off = azimuths - np.array([90, 210, 330])
    assert np.abs(off).max() <= 5.0
    assert abs(off.mean()) < 4 * 5.0 / np.sqrt(3 * off.size)
    moduli = np.array([unit.gel.shear_modulus_mpa for unit in units], float) / 0.145
    assert 1 - 0.2 <= moduli.min() < 0.9 < 1.1 < moduli.max() <= 1 + 0.2


def test_units_have_other_colours_and_moved_markers() -> None:
    frames, markers = [], []
    for seed in (0, 1):
        stage = VirtualStage(vary(DESIGN, seed), seed)
        frames.append(stage.frame().pixels.astype(float).mean((0, 1)))
        markers.append(stage.markers_px)
    assert np.abs(frames[0] / frames[0].sum() - frames[1] / frames[1].sum()).max() > 0.004
    pitch_px = 1.1 / 0.0276
    apart = np.hypot(*(markers[0] - markers[1]).T)
    assert 0.02 * pitch_px < np.median(apart) < pitch_px
