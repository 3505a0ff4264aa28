"""Distance and angle of a surface, from a model and pins."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.npz import read_npz, write_npz
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import MarkerField
from tactile_tactip.dome import Plate, pins_at_rest, pressed_pins, seen_px
from tactile_tactip.surface import SurfaceEstimator, SurfaceModel

Array = np.ndarray[Any, Any]

TACTIP = load_profile("tactip")
REST_PX = seen_px(pins_at_rest(), TACTIP.image)


def moved_px(plate: Plate) -> Array:
    return seen_px(pressed_pins(plate), TACTIP.image) - REST_PX


def pins(plate: Plate, order: Array | None = None, seen: int = 127) -> MarkerField:
    index = np.arange(127) if order is None else order
    places = (REST_PX + moved_px(plate))[index].astype(np.float32)
    reference = REST_PX[index].astype(np.float32)
    return MarkerField(
        np.arange(127, dtype=np.int32), reference, places, np.arange(127) < seen, 0.153, 2.5
    )


@pytest.fixture(scope="module")
def model() -> SurfaceModel:
    rng = np.random.default_rng(0)
    poses = np.column_stack([rng.uniform(0.5, 3.5, 200), rng.uniform(-20, 20, 200)])
    moved = np.stack([moved_px(Plate(d, a)) for d, a in poses])
    return SurfaceModel.fit(REST_PX, moved, poses)


@pytest.fixture
def step() -> SurfaceEstimator:
    return SurfaceEstimator(Options(), SensorContext(TACTIP.image, TACTIP.gel))


@pytest.mark.parametrize(("depth_mm", "angle_deg"), [(1.0, -15.0), (2.0, 0.0), (3.0, 12.0)])
def test_a_pressing_plate_is_measured(
    model: SurfaceModel, step: SurfaceEstimator, depth_mm: float, angle_deg: float
) -> None:
    pose = step.estimate(model, pins(Plate(depth_mm, angle_deg)))
    assert pose.distance_mm == pytest.approx(depth_mm, abs=0.05)
    assert pose.angle_deg == pytest.approx(angle_deg, abs=1.5)
    assert abs(pose.distance_mm - depth_mm) < 4 * pose.distance_std_mm
    assert abs(pose.angle_deg - angle_deg) < 4 * pose.angle_std_deg
    assert pose.timestamp_s == 2.5


def test_another_reference_may_list_the_pins_in_another_order(
    model: SurfaceModel, step: SurfaceEstimator
) -> None:
    plate = Plate(2.0, 7.0)
    one = step.estimate(model, pins(plate))
    order = np.random.default_rng(1).permutation(127)
    other = step.estimate(model, pins(plate, order))
    assert other.distance_mm == pytest.approx(one.distance_mm, abs=1e-6)
    assert other.angle_deg == pytest.approx(one.angle_deg, abs=1e-5)


def test_with_too_few_pins_it_knows_no_more_than_the_labels(
    model: SurfaceModel, step: SurfaceEstimator
) -> None:
    pose = step.estimate(model, pins(Plate(3.0, 10.0), seen=100))
    assert pose.distance_mm == pytest.approx(2.0, abs=0.2)
    assert pose.distance_std_mm == pytest.approx(3 / np.sqrt(12), rel=0.1)
    assert pose.angle_std_deg == pytest.approx(40 / np.sqrt(12), rel=0.1)
    assert "100 of 127 pins are too few" in pose.warnings()[0]


@pytest.mark.parametrize(
    ("plate", "what"), [(Plate(4.5, 0.0), "the distance is "), (Plate(3.0, -28.0), "the angle is ")]
)
def test_beyond_the_labels_it_warns(
    model: SurfaceModel, step: SurfaceEstimator, plate: Plate, what: str
) -> None:
    assert not step.estimate(model, pins(Plate(2.0, 10.0))).warnings()
    said = step.estimate(model, pins(plate)).warnings()
    assert any(one.startswith(what) and "label presses there" in one for one in said)


def test_the_pins_of_another_unit_are_refused(model: SurfaceModel, step: SurfaceEstimator) -> None:
    few = pins(Plate(1.0))
    few = MarkerField(few.ids[:91], few.reference_px[:91], few.px[:91], few.seen[:91], 0.153)
    with pytest.raises(InputError, match="fitted to 127 pins, and the 91 of this reference"):
        step.estimate(model, few)


def test_a_model_is_read_as_it_was_saved(model: SurfaceModel, tmp_path: Path) -> None:
    model.save(tmp_path)
    again = SurfaceModel.load(tmp_path)
    given = moved_px(Plate(2.0, 5.0))[None]
    for here, there in zip(model.poses(given), again.poses(given), strict=True):
        assert (here == there).all()


def test_a_damaged_model_says_what_to_do(model: SurfaceModel, tmp_path: Path) -> None:
    model.save(tmp_path)
    (path,) = tmp_path.iterdir()
    arrays = read_npz(path)
    for changed in (
        {**arrays, "pins_px": arrays["pins_px"][:-1]},
        {**arrays, "values": arrays["values"][:, :1]},
        {name: array for name, array in arrays.items() if name != "noise"},
    ):
        write_npz(path, changed)
        with pytest.raises(CalibrationError, match="run 'tactile calibrate-surface' again"):
            SurfaceModel.load(tmp_path)
