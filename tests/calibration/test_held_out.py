"""Nothing that a fold of the cross-validation uses depends on the pixels that it holds out."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from support.height_lab import HEIGHT, HeightLab, make_height_lab
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.builtin.lookup_table import Polynomial, PolynomialCalibrator
from tactile_core.calibration import press_search
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.scoring import FOLDS
from tactile_core.interfaces.calibration import Press
from tactile_core.quantities import Reference
from tactile_sim.optics.rig import render

HELD_OUT = 2
Folds = list[list[np.ndarray]]
Pixels = np.ndarray


@pytest.fixture
def inputs_of_folds(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Folds]:
    """Calibrate, and return samples, frames, reference, model and light of each fold."""
    folds: Folds = []
    fit, locate = PolynomialCalibrator.fit, press_search.locate

    def recorded(
        self: PolynomialCalibrator, samples: Sequence[Press], reference: Reference
    ) -> Polynomial:
        model = fit(self, samples, reference)
        arrays = [reference.pixels, *model.slopes.function.arrays().values()]
        for press in samples:
            assert press.heights_mm is not None
            arrays += [press.rows, press.columns, press.frame.pixels]
            arrays += [press.gradients, press.heights_mm]
        folds.append(arrays)
        return model

    def located(press: Any, light: Any, *more: Any) -> Any:
        folds[-1].append(light.coefficients)
        return locate(press, light, *more)

    monkeypatch.setattr(PolynomialCalibrator, "fit", recorded)
    monkeypatch.setattr(press_search, "locate", located)

    def run(*given: Any, **more: Any) -> Folds:
        folds.clear()
        made = calibrate(*given, model="core.polynomial", **more)
        assert made.score is not None
        assert len(folds) == FOLDS + 1, "one fit a fold, and one on all"
        return [*folds[:FOLDS], folds[-1]]

    return run


def same(one: Sequence[np.ndarray], other: Sequence[np.ndarray]) -> bool:
    return len(one) == len(other) and all(map(np.array_equal, one, other))


def assert_only_the_fold_that_holds_it_out_is_the_same(before: Folds, after: Folds) -> None:
    equal = [same(*pair) for pair in zip(before, after, strict=True)]
    assert equal == [fold == HELD_OUT % FOLDS for fold in range(FOLDS)] + [False]


def pressed_elsewhere(lab: VirtualLab) -> Pixels:
    return lab.image(BallPress((80.0, 60.0), BALL_MM, 0.9), seed=77)


def noise(lab: VirtualLab) -> Pixels:
    rows, columns = lab.profile.image.height_px, lab.profile.image.width_px
    return np.random.default_rng(0).integers(0, 256, (rows, columns, 3), np.uint8)


def test_circles_light_and_model_of_a_fold_do_not_depend_on_a_held_out_press(
    lab: VirtualLab,
    tmp_path: Path,
    inputs_of_folds: Callable[..., Folds],
) -> None:
    shutil.copytree(lab.presses, tmp_path / "presses")
    given = lab.profile, tmp_path / "presses", lab.reference
    before = inputs_of_folds(*given, ball_diameter_mm=BALL_MM)
    path = tmp_path / "presses" / f"press_{HELD_OUT}.png"
    for instead in (pressed_elsewhere, noise):
        cv2.imwrite(str(path), instead(lab)[..., ::-1])
        after = inputs_of_folds(*given, ball_diameter_mm=BALL_MM)
        located = before[HELD_OUT][-1].shape
        assert located == after[HELD_OUT][-1].shape, "the light model is compared too"
        if instead is noise:  # one press less is located, by the same light
            before[HELD_OUT].pop()
        assert_only_the_fold_that_holds_it_out_is_the_same(before, after)


def test_circles_and_model_of_a_fold_do_not_depend_on_held_out_balls_of_a_grid(
    lab: VirtualLab, tmp_path: Path, inputs_of_folds: Callable[..., Folds]
) -> None:
    spots = [(20 + 24 * x, 20 + 26 * y) for y in range(4) for x in range(6)]
    image, ball_mm = lab.profile.image, 0.5 * BALL_MM
    shape = image.height_px, image.width_px
    balls = [BallPress(spot, ball_mm, 0.18 * ball_mm) for spot in spots]
    height = np.sum([ball.height_mm(shape, image.mm_per_px) for ball in balls], axis=0)
    pixels = render(lab.profile, height, seed=50)
    target = tmp_path / "balls.yaml"
    lines = [f"radius: {ball_mm / 2}", f"pitch: {24 * image.mm_per_px}", "shapes:"]
    lines += [f"- {{x: {x}, y: {y}, gx: {i % 6}, gy: {i // 6}}}" for i, (x, y) in enumerate(spots)]
    target.write_text("\n".join(lines))

    given = lab.profile, tmp_path / "grid.png", lab.reference
    cv2.imwrite(str(tmp_path / "grid.png"), pixels[..., ::-1])
    before = inputs_of_folds(*given, target=target)
    x0, y0 = spots[HELD_OUT]
    on_ball = np.hypot(np.arange(shape[1]) - x0, np.arange(shape[0])[:, None] - y0) < 10
    pixels[on_ball] = noise(lab)[on_ball]
    cv2.imwrite(str(tmp_path / "grid.png"), pixels[..., ::-1])
    after = inputs_of_folds(*given, target=target)
    assert_only_the_fold_that_holds_it_out_is_the_same(before, after)


@pytest.mark.parametrize("given_reference", [True, False], ids=["reference", "from-press"])
def test_light_and_model_of_a_fold_do_not_depend_on_held_out_rows_of_a_height_map(
    tmp_path: Path, inputs_of_folds: Callable[..., Folds], given_reference: bool
) -> None:
    rig: HeightLab = make_height_lab(tmp_path)
    given = rig.profile, rig.press, rig.undeformed if given_reference else None
    before = inputs_of_folds(*given, target=rig.tmd)
    band = slice(HELD_OUT * HEIGHT // FOLDS, (HELD_OUT + 1) * HEIGHT // FOLDS)
    for seed, path in enumerate(sorted(rig.press.glob("*.png"))):
        exposure = np.asarray(cv2.imread(str(path), cv2.IMREAD_UNCHANGED))
        exposure[band] = np.random.default_rng(seed).integers(0, 256, exposure[band].shape)
        cv2.imwrite(str(path), exposure)
    after = inputs_of_folds(*given, target=rig.tmd)
    assert_only_the_fold_that_holds_it_out_is_the_same(before, after)
