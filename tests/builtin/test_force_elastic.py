"""Force by the gel's own mechanics, on the simulator's truth: any shape, nothing trained."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tactile_core.builtin.force_elastic import ElasticForce
from tactile_core.errors import InputError
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import ContactMask, DisplacementField, HeightMap, Wrench
from tactile_core.sim.stage import VirtualStage
from tactile_core.sim.truth import TrueState

SIZE = {"image": {"width_px": 160, "height_px": 120, "mm_per_px": 0.1104}}


@pytest.fixture(scope="module")
def stage() -> VirtualStage:
    return VirtualStage("hex_fingertip", seed=0, mode="fast", overrides=SIZE)


@pytest.fixture
def step(stage: VirtualStage) -> ElasticForce:
    profile = stage.profile
    return ElasticForce(Options(), SensorContext(profile.image, profile.gel))


def measured(step: ElasticForce, truth: TrueState) -> Wrench:
    everywhere = np.ones(truth.height_mm.shape, np.bool_)
    return step.estimate(
        HeightMap(truth.height_mm, everywhere, truth.mm_per_px, 1.5),
        ContactMask(truth.contact, truth.mm_per_px),
        DisplacementField(truth.displacement_mm, everywhere, truth.mm_per_px),
    )


@pytest.mark.parametrize(
    ("kind", "sizes", "depth_mm"),
    [
        ("sphere", {"diameter_mm": 12.0}, 0.4),
        ("cylinder", {"diameter_mm": 22.0, "length_mm": 12.0}, 0.3),
        ("flat", {"diameter_mm": 7.0}, 0.2),
    ],
)
def test_the_force_of_any_shape_is_that_of_the_simulator(
    stage: VirtualStage, step: ElasticForce, kind: str, sizes: dict[str, Any], depth_mm: float
) -> None:
    stage.reset()
    stage.indenter(kind, x_mm=1.5, y_mm=-1.0, **sizes)
    stage.press(depth_mm=depth_mm)
    stage.shear(dx_mm=0.1, dy_mm=-0.06, steps=2)
    stage.twist(degrees=2.0, steps=2)
    truth = stage.truth()
    found = measured(step, truth)
    fx, fy, fz, tz = truth.wrench
    shear = float(np.hypot(fx, fy))
    assert found.fx_n == pytest.approx(fx, abs=0.08 * shear)
    assert found.fy_n == pytest.approx(fy, abs=0.08 * shear)
    assert found.fz_n == pytest.approx(fz, rel=0.15)
    assert found.tz_nmm == pytest.approx(tz, abs=0.15 * abs(tz) + 0.1 * shear)
    assert found.timestamp_s == 1.5


def test_without_contact_there_is_no_force(stage: VirtualStage, step: ElasticForce) -> None:
    stage.reset()
    assert not measured(step, stage.truth()).values.any()


def test_a_tare_subtracts_the_load_until_the_reset(stage: VirtualStage, step: ElasticForce) -> None:
    stage.reset()
    stage.indenter("sphere", diameter_mm=12.0)
    stage.press(depth_mm=0.3)
    truth = stage.truth()
    whole = measured(step, truth)
    assert not step.tare(whole).values.any()
    assert np.abs(measured(step, truth).values).max() < 1e-9
    step.reset()
    np.testing.assert_allclose(measured(step, truth).values, whole.values)


@pytest.mark.parametrize("key", ["shear_modulus_mpa", "thickness_mm"])
def test_a_gel_without_stiffness_is_refused_by_the_name_of_the_key(key: str) -> None:
    profile = load_profile("hex_fingertip")
    gel = profile.gel.model_copy(update={key: None})
    with pytest.raises(InputError, match=rf"core\.force_elastic needs .* gel\.{key}"):
        ElasticForce(Options(), replace(SensorContext(profile.image, profile.gel), gel=gel))
