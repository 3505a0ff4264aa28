"""Every slope calibration on rendered presses of an analytic ball."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.gains import MOST, WELL_INSIDE, gains
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.acquisition.acquisition import average
from tactile_core.algorithms.circles.circle import Circle
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.algorithms.slopes.network import train
from tactile_core.builtin.lookup_table import (
    LookupTable,
    LookupTableCalibrator,
    LookupTableOptions,
    Polynomial,
    PolynomialCalibrator,
    PolynomialOptions,
    fit_curve,
)
from tactile_core.builtin.mlp import AutomaticCalibrator, Ensemble, Mlp, MlpCalibrator, MlpOptions
from tactile_core.calibration.presses import FoundPress
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Calibrator, Press
from tactile_core.quantities import Frame, Reference

Model = Polynomial | Mlp | LookupTable
CALIBRATORS = {
    "core.polynomial": PolynomialCalibrator,
    "core.mlp": MlpCalibrator,
    "core.lookup_table": LookupTableCalibrator,
}


class Bench:
    """Presses at known places, so that models are tested without circle finding."""

    def __init__(self, lab: VirtualLab, presses: int) -> None:
        self.scale = lab.profile.image.mm_per_px
        self.reference = average([self.frame(lab, None, 0)])
        rng = np.random.default_rng(8)
        balls = [
            BallPress((float(rng.uniform(25, 135)), float(rng.uniform(25, 95))), BALL_MM, 0.8)
            for _ in range(presses + 2)
        ]
        found = [self.found(lab, ball, seed) for seed, ball in enumerate(balls, 1)]
        self.unseen, self.presses = found[:2], found[2:]
        among = [(70.0, 62.0), (50.0, 40.0), (105.0, 70.0), (80.0, 50.0)]
        balls = [BallPress(centre, BALL_MM, 0.8) for centre in among]
        self.among = [self.found(lab, ball, seed) for seed, ball in enumerate(balls, 100)]

    def frame(self, lab: VirtualLab, ball: BallPress | None, seed: int) -> Frame:
        return Frame(lab.image(ball, seed), ("red", "green", "blue"), self.scale)

    def found(self, lab: VirtualLab, ball: BallPress, seed: int) -> FoundPress:
        frame = self.frame(lab, ball, seed)
        circle = Circle(ball.centre_px, ball.contact_radius_mm / self.scale)
        return FoundPress("ball", frame, circle, BALL_MM / 2 / self.scale)

    def samples(self) -> list[Press]:
        return [press.training() for press in self.presses]

    def error_deg(self, model: Model) -> float:
        errors = [p.normal_errors_deg(model.measure(p.frame, self.reference)) for p in self.unseen]
        return float(np.concatenate(errors).mean())

    def gains(self, model: Model) -> np.ndarray:
        """Gains of the slopes along x and y, on held-out presses between the training presses."""
        measured, true = [], []
        for press in self.among:
            found = model.measure(press.frame, self.reference)
            rows, columns, slopes = press.true_gradients(press.disc(WELL_INSIDE * press.radius_px))
            measured.append(np.stack([found.x[rows, columns], found.y[rows, columns]], 1))
            true.append(slopes)
        return gains(np.concatenate(measured), np.concatenate(true))


@pytest.fixture(scope="module")
def bench(lab: VirtualLab) -> Bench:
    return Bench(lab, 9)


@pytest.fixture(scope="module", params=CALIBRATORS)
def calibrator(request: pytest.FixtureRequest) -> Calibrator:
    return by_default(CALIBRATORS[request.param])


@pytest.fixture(scope="module")
def fitted(calibrator: Calibrator, bench: Bench) -> Model:
    model = calibrator.fit(bench.samples(), bench.reference)
    assert isinstance(model, Model)
    return model


def by_default(calibrator: type[Calibrator]) -> Calibrator:
    return calibrator(calibrator.Options())


def test_unseen_presses_are_measured_to_a_few_degrees(bench: Bench, fitted: Model) -> None:
    assert bench.error_deg(fitted) < 4


def test_slopes_are_unbiased(bench: Bench, fitted: Model) -> None:
    assert bench.gains(fitted) == pytest.approx(1, abs=MOST)


def test_a_saved_model_is_loaded_unchanged(bench: Bench, fitted: Model, tmp_path: Path) -> None:
    fitted.save(tmp_path)
    again = type(fitted).load(tmp_path)
    frame = bench.unseen[0].frame
    before, after = (m.measure(frame, bench.reference) for m in (fitted, again))
    np.testing.assert_array_equal(after.x, before.x)
    np.testing.assert_array_equal(after.y, before.y)


def test_fitting_again_gives_the_same_model(
    bench: Bench, calibrator: Calibrator, fitted: Model
) -> None:
    again = calibrator.fit(bench.samples(), bench.reference)
    assert isinstance(again, Model)
    assert bench.error_deg(again) == bench.error_deg(fitted)


def test_another_image_size_is_refused(bench: Bench, fitted: Model) -> None:
    frame = Frame(np.zeros((10, 10, 3), np.uint8), ("red", "green", "blue"), 0.1)
    with pytest.raises(CalibrationError, match="10 × 10"):
        fitted.measure(frame, bench.reference)


def test_a_file_of_something_else_is_refused(fitted: Model, tmp_path: Path) -> None:
    np.savez(tmp_path / "model.npz", shape=np.array([1, 2, 3]))
    with pytest.raises(CalibrationError, match="calibrate again"):
        type(fitted).load(tmp_path)


def test_presses_without_contact_are_refused(bench: Bench) -> None:
    press = bench.samples()[0]
    level = Press(press.frame, press.rows, press.columns, np.zeros_like(press.gradients))
    with pytest.raises(CalibrationError, match="too few pixels"):
        by_default(PolynomialCalibrator).fit([level], bench.reference)


def test_a_table_needs_three_channels(bench: Bench) -> None:
    press = bench.samples()[0]
    grey = Frame(press.frame.pixels[..., :1], ("grey",), bench.scale)
    reference = Reference(bench.reference.pixels[..., :1], ("grey",))
    only = Press(grey, press.rows, press.columns, press.gradients)
    with pytest.raises(CalibrationError, match="three channels"):
        by_default(LookupTableCalibrator).fit([only], reference)


@pytest.mark.parametrize("share", [0.0, 0.25])
def test_the_share_of_the_polynomial_weights_it_in_the_mean(share: float) -> None:
    rng = np.random.default_rng(0)
    features = rng.normal(size=(300, 5)).astype(np.float32)
    normal_xy = (0.3 * features[:, :2]).astype(np.float32)
    networks = train(features, normal_xy, hidden=(4,), epochs=1, seeds=(0, 1))
    curve = fit_curve(features, normal_xy)
    mean = (1 - share) * networks(features)
    both = Ensemble(networks, curve, share)
    np.testing.assert_allclose(both(features), mean + share * curve(features), atol=1e-6)
    again = Ensemble.from_arrays(both.arrays())
    np.testing.assert_array_equal(again(features), both(features))


@pytest.mark.parametrize(("presses", "model"), [(7, Polynomial), (8, Mlp)])
def test_few_presses_give_a_polynomial_and_many_a_network(
    lab: VirtualLab, presses: int, model: type[Model]
) -> None:
    small = Bench(lab, presses)
    chosen = by_default(AutomaticCalibrator).fit(small.samples(), small.reference)
    assert isinstance(chosen, model)


def test_the_first_order_term_of_a_table_depends_on_the_position() -> None:
    # lights at a higher elevation on the left: there, a slope changes the intensity less
    rng = np.random.default_rng(0)
    shape = 40, 60
    x = np.linspace(-1, 1, shape[1])
    reference = Reference(np.full((*shape, 3), 100, np.float32), ("red", "green", "blue"))
    azimuths = np.radians([90.0, 210.0, 330.0])

    def shown(slopes: np.ndarray) -> Frame:
        along = slopes @ np.stack([np.cos(azimuths), np.sin(azimuths)])
        pixels = reference.pixels * (1 - 0.5 * (1 + 0.3 * x[:, None]) * along)
        return Frame(pixels.astype(np.float32), reference.channels, 0.1)

    rows, columns = (place.ravel().astype(np.int32) for place in np.indices(shape))
    samples = []
    for _ in range(6):
        slopes = rng.uniform(-0.4, 0.4, (*shape, 2)).astype(np.float32)
        samples.append(Press(shown(slopes), rows, columns, slopes.reshape(-1, 2)))
    options = LookupTableOptions(bins=16, blur_px=0)
    model = LookupTableCalibrator(options).fit(samples, reference)
    slopes = rng.uniform(-0.3, 0.3, (*shape, 2))
    measured = model.measure(shown(slopes), reference)
    found = np.stack([measured.x, measured.y], -1)
    for third in np.array_split(np.arange(shape[1]), 3):
        gain = gains(found[:, third].reshape(-1, 2), slopes[:, third].reshape(-1, 2))
        assert gain == pytest.approx(1, abs=0.15)


@pytest.mark.parametrize("level", [255, 0], ids=["saturated", "dark"])
def test_two_readable_channels_make_a_slope_valid(bench: Bench, fitted: Model, level: int) -> None:
    frame = bench.unseen[0].frame
    pixels = frame.pixels.copy()
    pixels[5, 7, 1] = level
    pixels[5, 8, :2] = level
    spoilt = Frame(pixels, frame.channels, frame.mm_per_px)
    valid = fitted.measure(spoilt, bench.reference).valid
    assert valid[5, 7]
    assert not valid[5, 8]
    assert valid.sum() == valid.size - 1


def test_another_reference_is_refused(bench: Bench, fitted: Model) -> None:
    small = Reference(bench.reference.pixels[:50], bench.reference.channels)
    with pytest.raises(CalibrationError, match="this reference is 160 × 50"):
        fitted.measure(bench.unseen[0].frame, small)


def test_bit_depths_are_not_mixed(bench: Bench, fitted: Model) -> None:
    frame = bench.unseen[0].frame
    deep = Frame(frame.pixels.astype(np.uint16) * 257, frame.channels, frame.mm_per_px, 65535)
    with pytest.raises(CalibrationError, match="same bit depth"):
        fitted.measure(deep, bench.reference)


def test_sixteen_bits_give_the_slopes_of_eight(bench: Bench, fitted: Model) -> None:
    frame, eight = bench.unseen[0].frame, bench.reference
    deep = Frame(frame.pixels.astype(np.uint16) * 257, frame.channels, frame.mm_per_px, 65535)
    reference = Reference(eight.pixels * 257, eight.channels, 65535)
    first, second = fitted.measure(frame, eight), fitted.measure(deep, reference)
    assert np.abs(first.x - second.x).mean() < 0.01


@pytest.mark.parametrize("spoil", [lambda b: b[: len(b) // 2], lambda b: b"", lambda b: b"text"])
def test_a_corrupt_file_is_refused(
    fitted: Model, tmp_path: Path, spoil: Callable[[bytes], bytes]
) -> None:
    fitted.save(tmp_path)
    path = tmp_path / "model.npz"
    path.write_bytes(spoil(path.read_bytes()))
    with pytest.raises(CalibrationError, match="calibrate again"):
        type(fitted).load(tmp_path)


@pytest.mark.parametrize("blur_px", [np.nan, np.inf, -1.0, 1e9])
def test_an_impossible_smoothing_is_refused(fitted: Model, tmp_path: Path, blur_px: float) -> None:
    fitted.save(tmp_path)
    path = tmp_path / "model.npz"
    with np.load(path) as arrays:
        changed = {**arrays, "blur_px": np.array(blur_px)}
    np.savez(path, **changed)
    with pytest.raises(CalibrationError, match="calibrate again"):
        type(fitted).load(tmp_path)


@pytest.mark.parametrize("shape", [(np.inf, 9, 3), (0, 9, 3), (-1, 9, 3), (9, 9, 0)])
def test_an_impossible_image_size_is_refused(
    fitted: Model, tmp_path: Path, shape: tuple[float, ...]
) -> None:
    fitted.save(tmp_path)
    path = tmp_path / "model.npz"
    with np.load(path) as arrays:
        changed = {**arrays, "shape": np.array(shape)}
    np.savez(path, **changed)
    with pytest.raises(CalibrationError, match="calibrate again"):
        type(fitted).load(tmp_path)


def test_a_press_of_another_size_is_refused(bench: Bench) -> None:
    press = bench.samples()[0]
    frame = replace(press.frame, pixels=press.frame.pixels[:50])
    with pytest.raises(CalibrationError, match="record both at the same size"):
        by_default(PolynomialCalibrator).fit([replace(press, frame=frame)], bench.reference)


def test_no_press_at_all_is_refused(bench: Bench) -> None:
    with pytest.raises(CalibrationError, match="0 presses"):
        by_default(MlpCalibrator).fit([], bench.reference)


def test_gain_noise_in_training_reduces_errors_by_flicker(bench: Bench) -> None:
    def error_deg(gain_noise: float) -> float:
        options = MlpOptions(gain_noise=gain_noise)
        model = MlpCalibrator(options).fit(bench.samples(), bench.reference)
        errors = []
        for press in bench.unseen:
            for gain in (0.95, 1.05):
                bright = np.clip(press.frame.pixels * gain, 0, 255).astype(np.uint8)
                seen = model.measure(replace(press.frame, pixels=bright), bench.reference)
                errors.append(press.normal_errors_deg(seen))
        return float(np.concatenate(errors).mean())

    assert error_deg(0.03) < error_deg(0.0)


def test_the_smoothing_of_the_fit_is_that_of_the_measurement(bench: Bench, tmp_path: Path) -> None:
    options = PolynomialOptions(blur_px=4.0)
    model = PolynomialCalibrator(options).fit(bench.samples(), bench.reference)
    model.save(tmp_path)
    again = Polynomial.load(tmp_path)
    assert bench.error_deg(again) == bench.error_deg(model) < 4
