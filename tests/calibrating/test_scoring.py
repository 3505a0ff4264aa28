import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from virtual_lab import BALL_MM, VirtualLab

from tactile_core.bundle import Bundle
from tactile_core.calibrating import calibrate
from tactile_core.calibrating.presses import angles_deg

tilt = st.floats(-80, 80)


@given(tilt)
def test_a_tilt_from_flat_is_its_own_angle(degrees: float) -> None:
    slope = np.array([[np.tan(np.radians(degrees)), 0.0]])
    np.testing.assert_allclose(angles_deg(np.zeros((1, 2)), slope), [abs(degrees)], atol=1e-9)


@given(tilt, tilt)
def test_tilts_in_one_plane_differ_by_their_difference(a: float, b: float) -> None:
    first, second = (np.array([[0.0, np.tan(np.radians(t))]]) for t in (a, b))
    np.testing.assert_allclose(angles_deg(first, second), [abs(a - b)], atol=1e-9)


def test_the_score_comes_from_presses_left_out(lab: VirtualLab) -> None:
    held_out = Bundle.load(lab.bundle).manifest.held_out
    assert held_out is not None
    assert held_out["presses"] == 10
    assert held_out["normal_error_deg"]["mean"] < 0.2 * held_out["predict_flat_deg"]


def test_labels_overrule_what_is_found(lab: VirtualLab, tmp_path) -> None:  # type: ignore[no-untyped-def]
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
