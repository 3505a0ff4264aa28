import copy
import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.four_lights import Ball, frame_of, presses, undeformed
from support.gains import MOST, gains

from tactile_baxter_fingertip.hue_decoder import HueDecoder, fit_decoder
from tactile_baxter_fingertip.hue_intensity import (
    HueIntensity,
    HueIntensityCalibrator,
    HueIntensityOptions,
)
from tactile_core.algorithms.slopes.slope_grid import PressLight
from tactile_core.calibration.presses import angles_deg
from tactile_core.errors import CalibrationError
from tactile_core.plugins.registry import resolve
from tactile_core.quantities import Reference

UNSEEN = Ball((71.3, 64.8))


def fitted(*, mirrored: bool = False, **options: object) -> HueIntensity:
    calibrator = HueIntensityCalibrator(HueIntensityOptions.model_validate(options))
    return calibrator.fit(presses(12, mirrored=mirrored), undeformed(mirrored=mirrored))


@pytest.fixture(scope="module")
def model() -> HueIntensity:
    return fitted()


def errors_deg(model: HueIntensity, *, mirrored: bool = False, gain: float = 1.0) -> np.ndarray:
    """Angle between measured and true normals on a held-out ball."""
    frame = frame_of(UNSEEN, mirrored=mirrored, gain=gain)
    measured = model.measure(frame, undeformed(mirrored=mirrored))
    true, on = UNSEEN.slopes()
    return angles_deg(np.stack([measured.x[on], measured.y[on]], 1), true[on])


def test_calibrator_and_model_have_the_same_name() -> None:
    name = "baxter_fingertip.hue_intensity"
    assert resolve("calibrator", name) is HueIntensityCalibrator
    assert resolve("artefact", name) is HueIntensity


def test_a_model_with_two_tables_of_an_earlier_version_says_to_calibrate_again() -> None:
    # its tables are thinned out to every 32nd value
    with pytest.raises(CalibrationError, match="does not hold such a model; calibrate again"):
        HueIntensity.load(Path(__file__).parent / "data")


@pytest.mark.parametrize("ball", [UNSEEN, Ball((50.0, 50.0)), Ball((110.0, 70.0))])
def test_slopes_are_neither_steeper_nor_flatter_than_the_ball(
    model: HueIntensity, ball: Ball
) -> None:
    measured = model.measure(frame_of(ball), undeformed())
    true, on = ball.slopes()
    found = np.stack([measured.x[on], measured.y[on]], 1)
    assert gains(found, true[on]) == pytest.approx(1, abs=MOST)


def test_yaw_is_decoded_from_the_hue(model: HueIntensity) -> None:
    measured = model.measure(frame_of(UNSEEN), undeformed())
    true, on = UNSEEN.slopes()
    steep = on & (np.hypot(true[..., 0], true[..., 1]) > 0.3)
    found = np.arctan2(measured.y[steep], measured.x[steep])
    expected = np.arctan2(true[steep][:, 1], true[steep][:, 0])
    assert np.degrees(np.abs(np.angle(np.exp(1j * (found - expected))))).mean() < 2


@pytest.mark.parametrize("mirrored", [False, True])
def test_normals_are_right_for_either_order_of_the_hues(mirrored: bool) -> None:
    assert errors_deg(fitted(mirrored=mirrored), mirrored=mirrored).mean() < 2


def test_undeformed_gel_is_level(model: HueIntensity) -> None:
    level = model.measure(frame_of(None), undeformed())
    assert np.hypot(level.x, level.y).max() < 0.02


def test_a_brighter_illumination_does_not_change_the_hue(model: HueIntensity) -> None:
    assert errors_deg(model, gain=1.03).mean() < errors_deg(model).mean() + 1


def test_a_loaded_model_equals_the_saved_one(model: HueIntensity, tmp_path: Path) -> None:
    model.save(tmp_path)
    for again in (HueIntensity.load(tmp_path), pickle.loads(pickle.dumps(model))):
        before, after = (m.measure(frame_of(UNSEEN), undeformed()) for m in (model, again))
        np.testing.assert_array_equal(after.x, before.x)
        np.testing.assert_array_equal(after.y, before.y)


@pytest.mark.parametrize("damaged", [lambda b: b[: len(b) // 2], lambda b: b"", lambda b: b"text"])
def test_a_damaged_file_is_refused(
    model: HueIntensity, tmp_path: Path, damaged: Callable[[bytes], bytes]
) -> None:
    model.save(tmp_path)
    path = tmp_path / "model.npz"
    path.write_bytes(damaged(path.read_bytes()))
    with pytest.raises(CalibrationError, match="calibrate again"):
        HueIntensity.load(tmp_path)


@pytest.mark.parametrize("name", ["normalisation", "by_place"])
def test_misshapen_arrays_are_refused(model: HueIntensity, name: str) -> None:
    arrays = model.slopes.function.arrays()
    with pytest.raises(ValueError, match=name):
        HueDecoder.from_arrays({**arrays, name: arrays[name][:2]})


def test_another_size_is_refused(model: HueIntensity) -> None:
    frame, reference = frame_of(UNSEEN), undeformed()
    with pytest.raises(CalibrationError, match="this frame is 160 × 50"):
        model.measure(replace(frame, pixels=frame.pixels[:50]), reference)
    with pytest.raises(CalibrationError, match="this reference is 160 × 50"):
        model.measure(frame, replace(reference, pixels=reference.pixels[:50]))


def test_grey_images_have_no_hue() -> None:
    grey = Reference(undeformed().pixels[..., :1], ("grey",))
    with pytest.raises(CalibrationError, match="three channels"):
        HueIntensityCalibrator(HueIntensityOptions()).fit(presses(1), grey)


def test_presses_without_a_contact_are_refused() -> None:
    press = presses(1)[0]
    level = replace(press, gradients=np.zeros_like(press.gradients))
    for samples in ([], [level]):
        with pytest.raises(CalibrationError, match="too few pixels"):
            HueIntensityCalibrator(HueIntensityOptions()).fit(samples, undeformed())


def test_saturated_and_dark_pixels_are_not_valid(model: HueIntensity) -> None:
    frame = frame_of(UNSEEN)
    pixels = copy.copy(frame.pixels)
    pixels[5, 7, 1:] = 255
    pixels[5, 8] = 0
    valid = model.measure(replace(frame, pixels=pixels), undeformed()).valid
    assert not valid[5, 7]
    assert not valid[5, 8]
    assert valid.sum() == valid.size - 2


def test_another_bit_depth_is_refused(model: HueIntensity) -> None:
    frame = frame_of(UNSEEN)
    deep = replace(frame, pixels=frame.pixels.astype(np.uint16) * 257, full_scale=65535.0)
    with pytest.raises(CalibrationError, match="same bit depth"):
        model.measure(deep, undeformed())


def test_a_tilt_that_presses_have_in_common_is_none_of_the_undeformed_gel() -> None:
    # slopes of all presses seem to be larger by an amount that depends on the position
    rng = np.random.default_rng(1)
    normal_xy, position = rng.uniform(-0.5, 0.5, (2, 20_000, 2)).astype(np.float32)
    level = np.arange(len(normal_xy)) % 5 == 0
    normal_xy[level] = 0
    apparent = normal_xy + ~level[:, None] * (0.02 + 0.04 * position)
    colour = np.column_stack([apparent @ [[1, -0.5], [0, 0.9]], apparent @ [-0.5, -0.9]])
    features = np.column_stack([colour, position]).astype(np.float32)
    errors = []
    for by_place in (False, True):
        decoder, tilt = fit_decoder(features, normal_xy, by_place=by_place)
        found = decoder(features[~level]) + PressLight(tilt, 1.0).tilt_at(position[~level]).T
        errors.append(np.abs(found - normal_xy[~level]).mean())
        assert np.abs(decoder(np.zeros((1, 5), np.float32))).max() < 0.02
    assert errors[1] < 0.5 * errors[0]
