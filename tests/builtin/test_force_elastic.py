"""Force by the gel's own mechanics, on the simulator's truth: any shape, nothing trained."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactile_core.builtin.force_elastic import ElasticForce, ElasticForceOptions, GelStiffness
from tactile_core.errors import CalibrationError, InputError
from tactile_core.interfaces.estimator import ForceSamples, SensorContext
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import (
    ContactMask,
    ContactStress,
    DisplacementField,
    Frame,
    HeightMap,
    Wrench,
)
from tactile_core.quantities.wrench import UNKNOWN_LOAD
from tactile_sim.stage import VirtualStage
from tactile_sim.truth import TrueState

SIZE = {"image": {"width_px": 160, "height_px": 120, "mm_per_px": 0.1104}}


@pytest.fixture(scope="module")
def stage() -> VirtualStage:
    return VirtualStage("hex_fingertip", seed=0, mode="fast", overrides=SIZE)


@pytest.fixture(scope="module")
def sheared(stage: VirtualStage) -> TrueState:
    stage.reset()
    stage.indenter("sphere", diameter_mm=12.0, x_mm=1.5, y_mm=-1.0)
    stage.press(depth_mm=0.4)
    stage.shear(dx_mm=0.1, dy_mm=-0.06, steps=2)
    return stage.truth()


def made(stage: VirtualStage, options: dict[str, Any] | None = None, **gel: Any) -> ElasticForce:
    profile = stage.profile
    context = SensorContext(profile.image, profile.gel.model_copy(update=gel))
    return ElasticForce(ElasticForceOptions(**(options or {})), context)


@pytest.fixture
def step(stage: VirtualStage) -> ElasticForce:
    return made(stage)


def both(
    step: ElasticForce,
    truth: TrueState,
    timestamp_s: float = 1.5,
    wall_time_s: float = 0.0,
    stiffness: GelStiffness | None = None,
) -> tuple[Wrench, ContactStress]:
    height, width = truth.height_mm.shape
    black = np.zeros((height, width, 3), np.uint8)
    stamps = {"timestamp_s": timestamp_s, "wall_time_s": wall_time_s}
    frame = Frame(black, ("r", "g", "b"), truth.mm_per_px, **stamps)
    everywhere = np.ones(truth.height_mm.shape, np.bool_)
    return step.estimate(
        stiffness,
        frame,
        HeightMap(truth.height_mm, everywhere, truth.mm_per_px, timestamp_s),
        ContactMask(truth.contact, truth.mm_per_px),
        DisplacementField(truth.displacement_mm, everywhere, truth.mm_per_px),
    )


def measured(step: ElasticForce, truth: TrueState) -> Wrench:
    return both(step, truth)[0]


@pytest.mark.parametrize(
    ("kind", "sizes", "depth_mm", "share"),
    [
        ("sphere", {"diameter_mm": 8.0}, 0.1, 0.04),
        ("sphere", {"diameter_mm": 12.0}, 0.4, 0.03),
        ("sphere", {"diameter_mm": 30.0}, 0.4, 0.05),
        ("cylinder", {"diameter_mm": 22.0, "length_mm": 12.0}, 0.3, 0.05),
        ("flat", {"diameter_mm": 7.0}, 0.2, 0.06),
    ],
)
def test_the_force_of_any_shape_is_that_of_the_simulator(
    stage: VirtualStage,
    step: ElasticForce,
    kind: str,
    sizes: dict[str, Any],
    depth_mm: float,
    share: float,
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
    assert found.fz_n == pytest.approx(fz, rel=share)
    assert found.tz_nmm == pytest.approx(tz, abs=0.15 * abs(tz) + 0.1 * shear)
    assert found.timestamp_s == 1.5


@pytest.mark.parametrize(
    "wrong", [{"poisson_ratio": 0.432}, {"poisson_ratio": 0.499}, {"thickness_mm": 1.8}]
)
def test_a_wrong_gel_in_the_profile_is_corrected_by_the_field_beside_the_contact(
    stage: VirtualStage, sheared: TrueState, wrong: dict[str, float]
) -> None:
    right, found = measured(made(stage), sheared), measured(made(stage, **wrong), sheared)
    np.testing.assert_allclose(found.values, right.values, rtol=0.1, atol=0.01)


def test_the_modulus_scales_the_force(stage: VirtualStage, sheared: TrueState) -> None:
    modulus = stage.profile.gel.shear_modulus_mpa
    assert modulus is not None
    one = measured(made(stage), sheared).values
    two = measured(made(stage, shear_modulus_mpa=2 * modulus), sheared).values
    np.testing.assert_allclose(two, 2 * one, rtol=1e-3)


def test_the_stress_adds_up_to_the_force(step: ElasticForce, sheared: TrueState) -> None:
    wrench, stress = both(step, sheared)
    rows, columns = stress.pressure_cells_mpa.shape
    height_px, width_px = sheared.height_mm.shape
    cell_mm2 = height_px * width_px / rows / columns * sheared.mm_per_px**2
    fx, fy = stress.shear_cells_mpa.sum((0, 1)) * cell_mm2
    np.testing.assert_allclose(
        [fx, fy, stress.pressure_cells_mpa.sum() * cell_mm2], wrench.values[:3], rtol=1e-3
    )
    assert stress.pressure_mpa.shape == (height_px, width_px)
    assert stress.shear_mpa.shape == (height_px, width_px, 2)


def test_a_gel_that_is_known_less_gives_a_larger_standard_deviation(
    stage: VirtualStage, sheared: TrueState
) -> None:
    known, unknown = (
        measured(made(stage, {"gel_tolerance": tolerance}), sheared).std
        for tolerance in (0.02, 0.1)
    )
    assert known is not None
    assert unknown is not None
    assert (known < unknown).all()
    assert unknown[2] > 0.1 * sheared.wrench[2]


def test_without_contact_there_is_no_force(stage: VirtualStage, step: ElasticForce) -> None:
    stage.reset()
    wrench, stress = both(step, stage.truth())
    assert not wrench.values.any()
    assert wrench.std is not None
    assert (wrench.std[:3] < 0.05).all()
    assert not stress.pressure_cells_mpa.any()


def test_a_tare_subtracts_the_load_until_the_reset(step: ElasticForce, sheared: TrueState) -> None:
    whole = both(step, sheared)
    assert not step.tare(whole)[0].values.any()
    assert np.abs(measured(step, sheared).values).max() < 1e-6
    step.reset()
    np.testing.assert_allclose(measured(step, sheared).values, whole[0].values)


def test_the_force_of_a_relaxing_gel_follows_its_history(stage: VirtualStage) -> None:
    """A ball is pressed within a tenth of a second and held: the force decays, the shape stays."""
    prony = [{"modulus_share": 0.4, "time_s": 1.0}]
    slow = VirtualStage(
        "hex_fingertip", seed=0, mode="fast", overrides=SIZE | {"gel": {"prony": prony}}
    )
    force, relaxed = made(slow), made(slow, {"history": False})
    assert force.stateful
    assert not relaxed.stateful
    both(force, slow.truth(), slow.time_s, 1e9)
    slow.indenter("sphere", diameter_mm=12.0)
    slow.press(depth_mm=0.4, seconds=0.1)
    for seconds in (0.0, 0.5, 4.0):
        if seconds:
            slow.hold(seconds=seconds)
        truth = slow.truth()
        found = both(force, truth, slow.time_s, 1e9 + slow.time_s)[0]
        assert found.fz_n == pytest.approx(truth.wrench[2], rel=0.08), seconds
    assert measured(relaxed, truth).fz_n == pytest.approx(found.fz_n, rel=0.05)


def test_images_without_a_camera_s_time_have_no_history(stage: VirtualStage) -> None:
    gel = stage.profile.gel
    assert gel.prony
    force = made(stage)
    stage.reset()
    both(force, stage.truth(), 0.0)
    stage.indenter("sphere", diameter_mm=12.0)
    stage.press(depth_mm=0.4)
    truth = stage.truth()
    assert both(force, truth, 1 / 30)[0].fz_n == pytest.approx(truth.wrench[2], rel=0.08)
    always = made(stage, {"history": True})
    stage.reset()
    both(always, stage.truth(), 0.0)
    assert both(always, truth, 1 / 30)[0].fz_n > 1.2 * truth.wrench[2]


@pytest.mark.parametrize("key", ["shear_modulus_mpa", "thickness_mm"])
def test_a_gel_without_stiffness_is_refused_by_the_name_of_the_key(key: str) -> None:
    profile = load_profile("hex_fingertip")
    gel = profile.gel.model_copy(update={key: None})
    with pytest.raises(InputError, match=rf"core\.force_elastic needs .* gel\.{key}"):
        ElasticForce(
            ElasticForceOptions(), replace(SensorContext(profile.image, profile.gel), gel=gel)
        )


def test_specks_smaller_than_a_cell_are_no_contact(stage: VirtualStage, step: ElasticForce) -> None:
    """Such as the rims of markers, which a real sensor shows where nothing touches."""
    stage.reset()
    truth = stage.truth()
    size = truth.height_mm.shape
    everywhere = np.ones(size, np.bool_)
    specks = np.zeros(size, np.bool_)
    specks[4::12, 6::12] = specks[5::12, 6::12] = True
    wrench, _ = step.estimate(
        None,
        Frame(np.zeros((*size, 3), np.uint8), ("r", "g", "b"), truth.mm_per_px),
        HeightMap(np.full(size, 0.05, np.float32), everywhere, truth.mm_per_px),
        ContactMask(specks, truth.mm_per_px),
        DisplacementField(np.zeros((*size, 2), np.float32), everywhere, truth.mm_per_px),
    )
    assert not wrench.values.any()
    assert wrench.fz_std_n == pytest.approx(0.03)


def unmarked(step: ElasticForce, truth: TrueState, stiffness: GelStiffness | None = None) -> Wrench:
    """Measure what a gel without markers shows."""
    frame, height, contact = seen(truth)
    return step.estimate(stiffness, frame, height, contact, None)[0]


def seen(truth: TrueState) -> tuple[Frame, HeightMap, ContactMask]:
    shape = truth.height_mm.shape
    return (
        Frame(np.zeros((*shape, 3), np.uint8), ("r", "g", "b"), truth.mm_per_px),
        HeightMap(truth.height_mm, np.ones(shape, np.bool_), truth.mm_per_px),
        ContactMask(truth.contact, truth.mm_per_px),
    )


def test_a_gel_without_markers_shows_the_normal_force_alone(
    step: ElasticForce, sheared: TrueState
) -> None:
    found = unmarked(step, sheared)
    assert found.fz_n == pytest.approx(sheared.wrench[2], rel=0.1)
    assert not found.values[[0, 1, 3]].any()
    assert found.std is not None
    np.testing.assert_array_equal(found.std[[0, 1, 3]], UNKNOWN_LOAD)


@pytest.mark.parametrize(("modulus", "thickness"), [(3.0, 1.0), (0.5, 1.1), (1.0, 0.9)])
def test_one_weight_corrects_a_wrong_gel(
    stage: VirtualStage, sheared: TrueState, modulus: float, thickness: float
) -> None:
    gel = stage.profile.gel
    assert gel.shear_modulus_mpa is not None
    assert gel.thickness_mm is not None
    wrong = made(
        stage,
        shear_modulus_mpa=modulus * gel.shear_modulus_mpa,
        thickness_mm=thickness * gel.thickness_mm,
    )
    stage.reset()
    stage.indenter("flat", diameter_mm=7.0)
    stage.press(depth_mm=0.2)
    weight = stage.truth()
    features = wrong.features(*seen(weight), None)
    one = ForceSamples(
        "weight", features[None], np.array([[np.nan, np.nan, weight.wrench[2], np.nan]])
    )
    stiffness = wrong.fit([one])
    found = unmarked(wrong, sheared, stiffness)
    assert found.fz_n == pytest.approx(sheared.wrench[2], rel=0.2)
    assert found.fz_std_n is not None
    assert abs(found.fz_n - sheared.wrench[2]) < 2.5 * found.fz_std_n < 0.3 * found.fz_n


def test_without_a_weight_the_deviation_has_the_doubt_about_the_modulus(
    stage: VirtualStage, sheared: TrueState
) -> None:
    doubted = made(stage, {"modulus_tolerance": 0.7})
    found = unmarked(doubted, sheared)
    assert found.fz_std_n is not None
    assert 0.7 < found.fz_std_n / found.fz_n < 0.9
    assert doubted.fit([]).std == 0.7


def test_a_stiffness_is_saved_and_read_again(tmp_path: Path) -> None:
    GelStiffness(1.5, 0.08).save(tmp_path)
    again = GelStiffness.load(tmp_path)
    assert (again.factor, again.std) == (1.5, 0.08)
    (tmp_path / "stiffness.npz").write_bytes(b"no zip")
    with pytest.raises(CalibrationError, match="calibrate-force"):
        GelStiffness.load(tmp_path)


def test_weights_that_leave_no_contact_are_refused(step: ElasticForce) -> None:
    with pytest.raises(CalibrationError, match="no contact"):
        step.fit([ForceSamples("light", np.zeros((1, 1)), np.array([[0.0, 0.0, 1.0, 0.0]]))])


def test_a_mass_of_nothing_says_nothing(step: ElasticForce) -> None:
    nothing = ForceSamples("nothing", np.ones((1, 1)), np.zeros((1, 4)))
    assert step.fit([nothing]).factor == 1
