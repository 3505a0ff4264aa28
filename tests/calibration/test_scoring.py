from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.builtin.lookup_table import Polynomial, PolynomialCalibrator
from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.presses import angles_deg
from tactile_core.interfaces.calibration import Press
from tactile_core.quantities import Frame, Gradients, Reference

tilt = st.floats(-80, 80)


@given(tilt)
def test_the_angle_between_a_tilt_and_level_is_the_tilt(degrees: float) -> None:
    slope = np.array([[np.tan(np.radians(degrees)), 0.0]])
    np.testing.assert_allclose(angles_deg(np.zeros((1, 2)), slope), [abs(degrees)], atol=1e-9)


@given(tilt, tilt)
def test_the_angle_between_tilts_in_one_plane_is_their_difference(a: float, b: float) -> None:
    first, second = (np.array([[0.0, np.tan(np.radians(t))]]) for t in (a, b))
    np.testing.assert_allclose(angles_deg(first, second), [abs(a - b)], atol=1e-9)


def test_the_score_comes_from_held_out_presses(lab: VirtualLab) -> None:
    held_out = Bundle.load(lab.bundle).manifest.held_out
    assert held_out is not None
    assert held_out["presses"] == 10
    assert held_out["normal_error_deg"]["mean"] < 0.2 * held_out["predict_flat_deg"]


def test_labels_replace_the_circles_that_are_found(lab: VirtualLab, tmp_path: Path) -> None:
    rows = ["file,centre_x_px,centre_y_px,contact_radius_px"]
    rows += [f"press_{i}.png,{60 + i},{50 + i},9" for i in range(9)]
    labels = tmp_path / "labels.csv"
    labels.write_text("\n".join(rows) + "\n")
    result = calibrate(
        lab.profile,
        lab.presses,
        lab.reference,
        ball_diameter_mm=BALL_MM,
        labels=labels,
        model="core.polynomial",
    )
    circles = [press.circle for press in result.presses]
    assert [circle.centre_px for circle in circles[:9]] == [(60.0 + i, 50.0 + i) for i in range(9)]
    assert not circles[9].used
    assert "no row" in circles[9].why


def test_no_press_is_scored_by_a_model_that_was_fitted_on_it(
    lab: VirtualLab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fitted_on: dict[int, set[str]] = {}
    scored: list[tuple[str, set[str]]] = []
    models = []  # kept, so that no two have one identity
    fit, measure = PolynomialCalibrator.fit, Polynomial.measure

    def noted_fit(
        self: PolynomialCalibrator, presses: Sequence[Press], reference: Reference
    ) -> Polynomial:
        model = fit(self, presses, reference)
        models.append(model)
        fitted_on[id(model)] = {press.frame.source for press in presses}
        return model

    def noted_measure(self: Polynomial, frame: Frame, reference: Reference) -> Gradients:
        scored.append((frame.source, fitted_on[id(self)]))
        return measure(self, frame, reference)

    monkeypatch.setattr(PolynomialCalibrator, "fit", noted_fit)
    monkeypatch.setattr(Polynomial, "measure", noted_measure)
    rows = ["file,centre_x_px,centre_y_px,contact_radius_px"]
    rows += [f"press_{i}.png,{60 + i},{50 + i},9" for i in range(10)]
    labels = tmp_path / "labels.csv"
    labels.write_text("\n".join(rows) + "\n")
    calibrate(
        lab.profile,
        lab.presses,
        lab.reference,
        ball_diameter_mm=BALL_MM,
        labels=labels,
        model="core.polynomial",
    )
    presses = {f"press_{i}" for i in range(10)}
    assert {source for source, _ in scored} == presses
    assert [source for source, seen in scored if source in seen] == []
    assert all(len(seen) >= 8 for _, seen in scored)
    assert fitted_on[id(models[-1])] == presses, "the model that is kept is fitted to all presses"
