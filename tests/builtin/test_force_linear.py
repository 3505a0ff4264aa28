"""Force from a regression: a linear world is recovered, and the standard deviation covers."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.builtin.force_linear import (
    FEATURES,
    LinearForce,
    LinearForceModel,
    fitted_linear_model,
)
from tactile_core.calibration.force.result import held_out_forces, score_forces
from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.npz import write_npz
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import ForceSamples, SensorContext
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection
from tactile_core.quantities import (
    ContactMask,
    DisplacementField,
    HeightMap,
    MarkerField,
    RelativeLoad,
)
from tactile_core.quantities.wrench import UNKNOWN_LOAD

PX_MM = 0.5
ROWS, COLUMNS = 24, 32
Y_MM, X_MM = ((np.indices((ROWS, COLUMNS)).T - [(ROWS - 1) / 2, (COLUMNS - 1) / 2]).T) * PX_MM
EVERYWHERE = np.ones((ROWS, COLUMNS), np.bool_)


@pytest.fixture
def step() -> LinearForce:
    image = ImageSection(width_px=COLUMNS, height_px=ROWS, mm_per_px=PX_MM)
    return LinearForce(Options(), SensorContext(image, Gel()))


def field(dx: float = 0.0, dy: float = 0.0, turn: float = 0.0, grow: float = 0.0) -> Float64:
    """(H, W, 2) mm: a uniform shift, a rotation and a growth about the image centre."""
    return np.stack([dx - turn * Y_MM + grow * X_MM, dy + turn * X_MM + grow * Y_MM], -1)


def moved(mm: Float64) -> DisplacementField:
    return DisplacementField(mm.astype(np.float32), EVERYWHERE, PX_MM, 2.5)


def markers(mm: Float64) -> MarkerField:
    rows, columns = np.meshgrid(np.arange(1, ROWS, 3), np.arange(1, COLUMNS, 3), indexing="ij")
    at = np.stack([columns.ravel(), rows.ravel()], 1)
    px = at + mm[at[:, 1], at[:, 0]] / PX_MM
    ids = np.arange(len(at), dtype=np.int32)
    return MarkerField(
        ids, at.astype(np.float32), px.astype(np.float32), np.ones(len(at), np.bool_), PX_MM
    )


def pressed(depth_mm: float, x_mm: float = 0.0) -> tuple[HeightMap, ContactMask]:
    height = np.maximum(depth_mm - 0.1 * ((X_MM - x_mm) ** 2 + Y_MM**2), 0).astype(np.float32)
    return HeightMap(height, EVERYWHERE, PX_MM), ContactMask(height > 0, PX_MM)


def sequences(step: LinearForce, count: int = 6, noise: float = 0.0) -> list[ForceSamples]:
    """Presses of a gel whose force is proportional to how it moves, in markers alone."""
    rng = np.random.default_rng(0)
    found = []
    for number in range(count):
        features, forces = [], []
        for _ in range(12):
            dx, dy, turn, grow = rng.normal(0, [0.1, 0.1, 0.02, 0.03])
            mm = field(dx, dy, turn, abs(grow))
            features.append(step.features(moved(mm), None, None, None, None))
            moment = float((X_MM**2 + Y_MM**2).mean()) * turn
            spread = float((X_MM**2 + Y_MM**2).mean()) * abs(grow)
            forces.append([17 * dx, 17 * dy, 9 * spread, 30 * moment])
        load = np.array(forces)
        found.append(
            ForceSamples(str(number), np.array(features), load + rng.normal(0, noise, load.shape))
            if noise
            else ForceSamples(str(number), np.array(features), load)
        )
    return found


def test_a_linear_world_is_recovered(step: LinearForce) -> None:
    samples = sequences(step)
    model = step.fit(samples)
    wrench = step.estimate(model, moved(field(0.2, -0.1, 0.01)), None, None, None, None)
    moment = 30 * float((X_MM**2 + Y_MM**2).mean()) * 0.01
    assert wrench.values == pytest.approx([3.4, -1.7, 0, moment], abs=0.02)
    assert wrench.timestamp_s == 2.5
    for score in score_forces(samples, *held_out_forces(samples, step.fit)).values():
        assert score.r2 > 0.9999


def test_markers_alone_give_the_features_of_the_field(step: LinearForce) -> None:
    mm = field(0.1, -0.2, 0.02, 0.03)
    by_field = step.features(moved(mm), None, None, None, None)
    by_markers = step.features(None, markers(mm), pressed(0)[1], None, None)
    for name in ("shift_x", "shift_y"):
        index = FEATURES.index(name)
        assert by_markers[index] == pytest.approx(by_field[index], abs=0.03)
    for name in ("moment", "divergence", "spread"):
        index = FEATURES.index(name)
        assert by_markers[index] == pytest.approx(by_field[index], rel=0.15)


def test_a_finer_field_has_the_same_features(step: LinearForce) -> None:
    coarse = field(0.1, -0.2, 0.02, 0.03)
    fine = np.kron(coarse, np.ones((10, 10, 1)))
    valid = np.ones(fine.shape[:2], np.bool_)
    dense = DisplacementField(fine.astype(np.float32), valid, PX_MM / 10)
    given = moved(coarse), dense
    few, many = (step.features(one, None, None, None, None) for one in given)
    assert many == pytest.approx(few, rel=0.03, abs=1e-3, nan_ok=True)


def test_the_standard_deviation_covers_held_out_errors(step: LinearForce) -> None:
    samples = sequences(step, count=12, noise=0.2)
    for score in score_forces(samples, *held_out_forces(samples, step.fit)).values():
        assert score.within_std == pytest.approx(0.68, abs=0.1)
        assert score.rmse == pytest.approx(0.2, rel=0.25)


def test_an_undeformed_gel_has_no_force(step: LinearForce) -> None:
    model = step.fit(sequences(step, noise=0.1))
    still = step.estimate(model, moved(field()), None, None, None, None)
    assert not still.values.any()
    assert still.std is not None
    assert (still.std > 0).all()


def test_a_score_never_sees_its_own_sequence(step: LinearForce) -> None:
    fitted_on: list[set[str]] = []

    def fit(given: list[ForceSamples]) -> LinearForceModel:
        fitted_on.append({one.name for one in given})
        return fitted_linear_model(given)

    samples = sequences(step)
    held_out_forces(samples, fit)  # type: ignore[arg-type]
    assert fitted_on == [{one.name for one in samples} - {s.name} for s in samples]


def test_a_load_alone_becomes_a_force_that_rises_with_it(step: LinearForce) -> None:
    loads = np.linspace(0, 4, 15)
    samples = []
    for number in range(4):
        given = [RelativeLoad(float(load)) for load in loads]
        features = np.array([step.features(None, None, None, None, one) for one in given])
        forces = np.full((15, 4), np.nan)
        forces[:, 2] = 3 * loads + 0.5 * loads**2
        samples.append(ForceSamples(str(number), features, forces))
    model = step.fit(samples)
    found = [
        step.estimate(model, None, None, None, None, RelativeLoad(float(load))) for load in loads
    ]
    assert [one.fz_n for one in found] == pytest.approx(list(3 * loads + 0.5 * loads**2), abs=0.05)
    assert (np.diff([one.fz_n for one in found]) >= 0).all()
    assert found[3].fx_n == 0
    assert found[3].fx_std_n == UNKNOWN_LOAD


def test_depth_and_contact_give_normal_force(step: LinearForce) -> None:
    samples = []
    for number in range(5):
        features, forces = [], []
        for depth_mm in np.linspace(0, 1, 8):
            height, contact = pressed(float(depth_mm), x_mm=number - 2.0)
            features.append(step.features(None, None, contact, height, None))
            forces.append([np.nan, np.nan, 0.7 * float(height.mm.sum()) * PX_MM**2, np.nan])
        samples.append(ForceSamples(str(number), np.array(features), np.array(forces)))
    score = score_forces(samples, *held_out_forces(samples, step.fit), FEATURES)["fz_n"]
    assert score.r2 > 0.999
    assert score.proportional is not None
    assert score.proportional.feature == "volume"
    assert score.proportional.slope == pytest.approx(0.7)


def test_a_tare_subtracts_the_load_until_the_reset(step: LinearForce) -> None:
    model = step.fit(sequences(step))
    given = model, moved(field(0.1)), None, None, None, None
    whole = step.estimate(*given)
    assert not step.tare(whole).values.any()
    assert not step.estimate(*given).values.any()
    step.reset()
    assert step.estimate(*given).fx_n == pytest.approx(whole.fx_n)


def test_a_model_survives_its_bundle_and_a_pickle(step: LinearForce, tmp_path: Path) -> None:
    model = step.fit(sequences(step, noise=0.1))
    model.save(tmp_path)
    for copy in (LinearForceModel.load(tmp_path), pickle.loads(pickle.dumps(model))):
        np.testing.assert_array_equal(copy.weights, model.weights)
        np.testing.assert_array_equal(copy.errors, model.errors)


def test_a_damaged_model_is_refused(step: LinearForce, tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match="calibrate-force"):
        LinearForceModel.load(tmp_path)
    model = step.fit(sequences(step))
    wrong = {"weights": model.weights[:2], "errors": model.errors, "used": model.used}
    write_npz(tmp_path / "force.npz", {**wrong, "features": np.array(FEATURES)})
    with pytest.raises(CalibrationError, match="calibrate-force"):
        LinearForceModel.load(tmp_path)


def test_a_chain_without_the_fitted_quantities_is_refused(step: LinearForce) -> None:
    model = step.fit(sequences(step))
    with pytest.raises(InputError, match="which this chain does not measure"):
        step.estimate(model, None, None, None, None, RelativeLoad(1.0))


def test_nothing_to_fit_is_refused(step: LinearForce) -> None:
    nothing = step.features(None, None, None, None, None)[None]
    with pytest.raises(CalibrationError, match="needs a displacement"):
        step.fit([ForceSamples("a", nothing, np.ones((1, 4)))])
    load = step.features(None, None, None, None, RelativeLoad(1.0))[None]
    only_shear = np.array([[1.0, np.nan, np.nan, np.nan]])
    with pytest.raises(CalibrationError, match="no measured force can be fitted"):
        step.fit([ForceSamples("a", load, only_shear)])
