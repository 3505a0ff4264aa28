"""One press of a ball calibrates a gel that darkens with depth."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_9dtact.darkness import Darkness, DarknessCalibrator, DarknessOptions
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Press
from tactile_core.quantities import Float32, Frame, HeightMap, Reference
from tactile_core.quantities.quantity import replace_values

Law = Callable[[Float32], NDArray[np.float64]]

SHAPE, MM_PER_PX, BALL_MM = (150, 200), 0.1, 8.0
CHANNELS = ("red", "green", "blue")
RIM_SHARE = 0.25  # Of the height of the rim to that of the cap above it, as on a layer of gel
LIGHT = np.array([0.55, 0.6, 0.62])  # of white LEDs, as the camera sees them


def absorbs(height_mm: Float32) -> NDArray[np.float64]:
    """Ratio to the reference by Lambert and Beer."""
    return np.asarray(np.exp(-0.25 * height_mm))


def scatters(height_mm: Float32) -> NDArray[np.float64]:
    """Ratio to the reference of a thin layer, in proportion to its thickness."""
    return np.asarray(1 - 0.2 * height_mm)


def field(vignetting: float = 0.4) -> NDArray[np.float64]:
    """Brightness of the undeformed gel, which falls off towards the corners."""
    y, x = (np.linspace(-1, 1, side) for side in SHAPE)
    fall_off = 1 - vignetting * (y[:, None] ** 2 + x**2) / 2
    return np.asarray(255 * fall_off[..., None] * LIGHT)


def reference(light: float = 1.0) -> Reference:
    return Reference((light * field()).astype(np.float32), CHANNELS)


def frame(height_mm: Float32, law: Law, light: float = 1.0) -> Frame:
    noise = np.random.default_rng(0).normal(0, 0.5, (*SHAPE, 3))
    pixels = light * field() * law(height_mm)[..., None] + noise
    return Frame(np.rint(pixels).astype(np.uint8), CHANNELS, MM_PER_PX)


def surface(ball: BallPress) -> Float32:
    """Heights of a layer that follows a ball, and bulges farther away as it keeps its volume."""
    y, x = np.indices(SHAPE)
    r = np.hypot(x - ball.centre_px[0], y - ball.centre_px[1]) * MM_PER_PX
    radius, a = ball.diameter_mm / 2, ball.contact_radius_mm
    rim_mm = RIM_SHARE * ball.depth_mm
    inside = np.sqrt(np.maximum(radius**2 - r**2, 0)) - np.sqrt(radius**2 - a**2) + rim_mm
    beyond = np.maximum(r - a, 0)
    outside = (rim_mm + 0.1) * np.exp(-beyond / 0.4) - 0.1 * np.exp(-beyond / 2.0)
    return np.where(r < a, inside, outside).astype(np.float32)


def press_of(
    ball: BallPress, law: Law, *, level_mm: float = 0.0, off_px: float = 0.0, light: float = 1.0
) -> Press:
    """Return the pixels on a ball as a search for circles labels them, not quite right."""
    y, x = np.indices(SHAPE)
    dx, dy = (x - ball.centre_px[0] - off_px) * MM_PER_PX, (y - ball.centre_px[1]) * MM_PER_PX
    radius = ball.diameter_mm / 2
    at = np.nonzero(np.hypot(dx, dy) < min(ball.contact_radius_mm, 0.75 * radius) - 0.2)
    down = np.sqrt(radius**2 - dx**2 - dy**2, where=np.hypot(dx, dy) < radius, out=dx * 0 + 1)
    slopes = np.stack([-dx / down, -dy / down], axis=-1)[at]
    return Press(
        frame(surface(ball), law, light),
        *(part.astype(np.int32) for part in at),
        slopes.astype(np.float32),
        heights_mm=(down[at] + level_mm).astype(np.float32),
    )


def calibrated(*presses: Press, light: float = 1.0) -> Darkness:
    return DarknessCalibrator(DarknessOptions()).fit(presses, reference(light))


PRESSED = BallPress((100.0, 75.0), BALL_MM, 1.2)
OTHERS = [
    BallPress((60.0, 50.0), BALL_MM, 0.9),
    BallPress((140.0, 95.0), 5.0, 0.6),
    BallPress((45.0, 100.0), 12.0, 0.7),
]


def rms_mm(measured: HeightMap, ball: BallPress) -> float:
    y, x = np.indices(SHAPE)
    distance = np.hypot(x - ball.centre_px[0], y - ball.centre_px[1]) * MM_PER_PX
    error = (measured.mm - surface(ball))[distance < ball.contact_radius_mm]
    return float(np.sqrt(np.mean(error**2)))


@pytest.mark.parametrize("law", [absorbs, scatters])
@pytest.mark.parametrize("ball", OTHERS)
def test_one_press_measures_other_balls_elsewhere(law: Law, ball: BallPress) -> None:
    model = calibrated(press_of(PRESSED, law))
    assert rms_mm(model.measure(frame(surface(ball), law), reference()), ball) < 0.05


@pytest.mark.parametrize("law", [absorbs, scatters])
def test_more_presses_leave_a_smaller_error(law: Law) -> None:
    one = calibrated(press_of(PRESSED, law))
    more = calibrated(*(press_of(ball, law) for ball in (PRESSED, *OTHERS)))
    last = BallPress((150.0, 40.0), BALL_MM, 1.0)
    errors = [
        rms_mm(model.measure(frame(surface(last), law), reference()), last) for model in (one, more)
    ]
    assert errors[1] < min(errors[0], 0.02)


def test_the_depth_of_the_press_follows_from_the_image_not_from_its_circle() -> None:
    models = [calibrated(press_of(PRESSED, absorbs, level_mm=mm)) for mm in (-3.0, 2.0)]
    depths = [model.measure(frame(surface(PRESSED), absorbs), reference()).mm for model in models]
    np.testing.assert_allclose(depths[0], depths[1], atol=1e-4)


def test_a_circle_that_is_off_by_two_pixels_hardly_changes_the_depth() -> None:
    right, off = (calibrated(press_of(PRESSED, absorbs, off_px=px)) for px in (0.0, 2.0))
    ball = OTHERS[0]
    seen = frame(surface(ball), absorbs)
    np.testing.assert_allclose(
        off.measure(seen, reference()).mm, right.measure(seen, reference()).mm, atol=0.04
    )


def test_neither_the_brightness_of_the_leds_nor_the_fall_off_of_the_lens_matters() -> None:
    model = calibrated(press_of(PRESSED, absorbs))
    ball = BallPress((35.0, 35.0), BALL_MM, 1.2)  # in a corner
    bright, dim = (
        model.measure(frame(surface(ball), absorbs, light), reference(light)).mm
        for light in (1.0, 0.6)
    )
    middle = model.measure(frame(surface(PRESSED), absorbs), reference()).mm
    assert np.abs(bright - dim).max() < 0.1  # of the noise, which is larger in dim light
    assert bright[35, 35] == pytest.approx(middle[75, 100], abs=0.03)


def plateau(height_mm: float) -> Float32:
    """Heights of a gel that is level but for a disc in the middle."""
    y, x = np.indices(SHAPE)
    inside = np.hypot(x - 100, y - 75) * MM_PER_PX < 3.0
    return np.where(inside, height_mm, 0).astype(np.float32)


def test_gel_that_bulges_is_measured_as_such() -> None:
    model = calibrated(press_of(PRESSED, absorbs))
    height = model.measure(frame(plateau(-0.2), absorbs), reference())
    assert height.mm[75, 100] == pytest.approx(-0.2, abs=0.03)


def test_deeper_than_the_calibration_is_still_deeper() -> None:
    model = calibrated(press_of(BallPress((100.0, 75.0), BALL_MM, 0.6), absorbs))
    assert (np.diff(model.curve.depth_mm) >= 0).all()
    deep = model.measure(frame(plateau(1.5), absorbs), reference())
    assert deep.mm[75, 100] == pytest.approx(1.5, abs=0.15)


@pytest.mark.parametrize("light", [0.95, 1.02])
def test_leds_that_drift_after_the_reference_do_not_change_the_depth(light: float) -> None:
    model = calibrated(press_of(PRESSED, absorbs))
    ball = OTHERS[0]
    steady, drifted = (
        model.measure(frame(surface(ball), absorbs, each), reference()).mm for each in (1.0, light)
    )
    assert np.sqrt(np.mean((steady - drifted) ** 2)) < 0.03


def test_a_contact_that_fills_the_image_is_no_drift() -> None:
    model = calibrated(press_of(PRESSED, absorbs))
    height = model.measure(frame(np.full(SHAPE, 0.8, np.float32), absorbs), reference())
    assert np.median(height.mm) == pytest.approx(0.8, abs=0.1)


def test_the_deviation_is_that_of_a_ball_which_is_not_quite_as_the_law() -> None:
    press = press_of(PRESSED, absorbs)
    assert press.heights_mm is not None
    wavy_mm = press.heights_mm + 0.1 * np.sin(press.columns / 3).astype(np.float32)
    exact, uneven = calibrated(press), calibrated(replace_values(press, heights_mm=wavy_mm))
    seen = frame(surface(PRESSED), absorbs)
    small, large = (model.measure(seen, reference()).std_mm for model in (exact, uneven))
    assert small is not None
    assert large is not None
    assert small[75, 100] < 0.03
    assert large[75, 85] == pytest.approx(0.07, abs=0.02)  # 0.1 / √2


def test_saturated_and_dark_pixels_are_not_valid() -> None:
    model = calibrated(press_of(PRESSED, absorbs))
    seen = frame(surface(PRESSED), absorbs)
    pixels = seen.pixels.copy()
    pixels[3, 4, 1], pixels[5, 6] = 255, 0
    valid = model.measure(Frame(pixels, CHANNELS, MM_PER_PX), reference()).valid
    assert np.argwhere(~valid).tolist() == [[3, 4], [5, 6]]


def test_a_bundle_measures_as_the_model_that_it_was_made_of(tmp_path: Path) -> None:
    model = calibrated(press_of(PRESSED, absorbs))
    model.save(tmp_path)
    seen = frame(surface(OTHERS[0]), absorbs)
    np.testing.assert_array_equal(
        Darkness.load(tmp_path).measure(seen, reference()).mm, model.measure(seen, reference()).mm
    )


def test_a_damaged_model_is_refused(tmp_path: Path) -> None:
    calibrated(press_of(PRESSED, absorbs)).save(tmp_path)
    with np.load(tmp_path / "model.npz") as data:
        arrays = dict(data)
    arrays["darkening"] = arrays["darkening"][::-1]
    np.savez(tmp_path / "model.npz", **arrays)
    with pytest.raises(CalibrationError, match="calibrate again"):
        Darkness.load(tmp_path)


def brightens(height_mm: Float32) -> NDArray[np.float64]:
    return np.asarray(1 + 0.2 * height_mm)


def test_an_image_that_brightens_is_one_sentence() -> None:
    with pytest.raises(CalibrationError, match="does not darken where the ball presses; exchange"):
        calibrated(press_of(PRESSED, brightens))


def test_coloured_light_is_one_sentence() -> None:
    press = press_of(PRESSED, absorbs)
    pixels = press.frame.pixels.astype(float)
    slope = np.gradient(surface(PRESSED), MM_PER_PX, axis=1)
    pixels[..., 0] *= 1 + 0.4 * slope
    pixels[..., 2] *= 1 - 0.4 * slope
    coloured = Frame(np.clip(pixels, 0, 255).astype(np.uint8), CHANNELS, MM_PER_PX)
    with pytest.raises(CalibrationError, match="so its light is not white; take a model for"):
        calibrated(replace_values(press, frame=coloured, name="a.png"))


def test_presses_without_pixels_on_a_ball_are_one_sentence() -> None:
    level = np.zeros(20, np.int32)
    flat = Press(
        frame(np.zeros(SHAPE, np.float32), absorbs),
        level,
        level,
        np.zeros((20, 2), np.float32),
        heights_mm=np.zeros(20, np.float32),
    )
    for presses in ([], [flat]):
        with pytest.raises(CalibrationError, match="too few pixels to fit on"):
            calibrated(*presses)
