"""The shipped force network, on units, objects and places that it has not seen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tactile_networks
from tactile_core.errors import InputError
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Reference
from tactile_networks.manifest import NetworkFile
from tactile_networks.steps import ForceNetwork
from tactile_sim.stage import VirtualStage, vary

FOLDER = Path(tactile_networks.__file__).parent / "shipped"
UNSEEN_UNIT = 20_001
LARGEST_BYTES = 5_000_000


def test_it_is_small_and_the_one_that_its_manifest_describes() -> None:
    file = NetworkFile(FOLDER / "hex_fingertip_virtual.yaml")
    content = file.content()
    assert len(content) < LARGEST_BYTES
    assert file.manifest.licence == "MIT"
    sheet = (FOLDER / "hex_fingertip_virtual.md").read_text(encoding="utf-8")
    assert file.manifest.sha256 in sheet
    assert "`tactile train-force hex_fingertip" in sheet


@pytest.fixture(scope="module")
def stage() -> VirtualStage:
    return VirtualStage(vary(load_profile("hex_fingertip", sim=True), UNSEEN_UNIT), UNSEEN_UNIT)


@pytest.fixture(scope="module")
def step(stage: VirtualStage) -> ForceNetwork:
    options = ForceNetwork.Options(manifest="hex_fingertip_virtual")
    return ForceNetwork(options, SensorContext(stage.profile.image, stage.profile.gel))


@pytest.mark.parametrize(
    ("kind", "sizes"),
    [
        ("sphere", {"diameter_mm": 25.0}),
        ("cylinder", {"diameter_mm": 22.0, "length_mm": 12.0}),
    ],
)
def test_an_unseen_press_is_measured(
    stage: VirtualStage, step: ForceNetwork, kind: str, sizes: dict[str, Any]
) -> None:
    stage.reset()
    undeformed = stage.frame()
    reference = Reference(undeformed.pixels.astype(np.float32), undeformed.channels)
    assert step.estimate(undeformed, reference, None, None).fz_n == pytest.approx(0, abs=0.5)
    stage.indenter(kind, x_mm=1.0, y_mm=-0.5, angle_deg=20, **sizes)
    stage.press(force_n=8.0)
    stage.move(dx_mm=0.25, dy_mm=-0.15, degrees=2)
    found = step.estimate(stage.frame(), reference, None, None)
    fx, fy, fz, tz = stage.wrench
    shear = float(np.hypot(fx, fy))
    assert found.fz_n == pytest.approx(fz, rel=0.2)
    assert np.hypot(found.fx_n - fx, found.fy_n - fy) < 0.25 * shear
    assert found.tz_nmm == pytest.approx(tz, abs=0.3 * abs(tz) + shear)
    assert found.std is not None
    assert (np.abs(found.values - stage.wrench) < 5 * found.std).all()


def test_another_rig_is_refused() -> None:
    profile = load_profile("desktop_three_colour")
    options = ForceNetwork.Options(manifest="hex_fingertip_virtual")
    with pytest.raises(InputError, match="use a network that was trained for this sensor"):
        ForceNetwork(options, SensorContext(profile.image, profile.gel))
