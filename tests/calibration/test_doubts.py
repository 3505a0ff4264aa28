"""What the score of a calibration reveals of errors that train and judge alike."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.algorithms.circles.circle import Circle
from tactile_core.calibration.doubts import DOUBTS, implausible
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.presses import FoundPress
from tactile_core.calibration.result import Calibrated
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame, Reference
from tactile_sim.optics.rig import RigOptics

BALL_PX = BALL_MM / 2 / 0.1245


def calibrated(lab: VirtualLab, presses: Path | None = None, **options: object) -> Calibrated:
    given: dict[str, object] = {"ball_diameter_mm": BALL_MM, "model": "core.polynomial", **options}
    return calibrate(lab.profile, presses or lab.presses, lab.reference, **given)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def true(lab: VirtualLab) -> Calibrated:
    return calibrated(lab)


@pytest.fixture
def with_circles(
    lab: VirtualLab, true: Calibrated, tmp_path: Path
) -> Callable[[Callable[[float, float], tuple[float, float]]], Calibrated]:
    """Calibrate on circles that are somewhere else."""

    def made(moved: Callable[[float, float], tuple[float, float]]) -> Calibrated:
        rows = ["file,centre_x_px,centre_y_px,contact_radius_px"]
        for press in true.presses:
            x, y = moved(*press.centre_px)
            rows.append(f"{press.file},{x},{y},{press.radius_px}")
        labels = tmp_path / "labels.csv"
        labels.write_text("\n".join(rows) + "\n")
        return calibrated(lab, labels=labels)

    return made


def offset_of(made: Calibrated) -> float:
    """90th percentile of the offsets of the spheres, in ball radii."""
    assert made.score is not None
    offsets = made.score.sphere_offsets_px()
    assert offsets is not None
    return offsets[1] / BALL_PX


def test_true_circles_raise_no_doubt(true: Calibrated) -> None:
    assert true.score is not None
    assert true.notes == ()
    assert offset_of(true) < 0.2 * DOUBTS.offset
    quartiles = true.score.sphere_quartiles()
    assert quartiles is not None
    assert quartiles == pytest.approx((1, 1, 1), abs=0.06)


def test_circles_that_are_all_shifted_are_doubted(
    with_circles: Callable[..., Calibrated],
) -> None:
    shifted = with_circles(lambda x, y: (x + 3, y))
    # Undeformed pixels hold the calibration at the truth; it follows the labels in part.
    assert 1.3 * DOUBTS.offset < offset_of(shifted) < 1.2 * 3 / BALL_PX
    assert any("not where the circles were found" in note for note in shifted.notes)
    assert shifted.score is not None
    assert shifted.score.mean_deg < 0.25 * shifted.score.predict_flat_deg, "flattered by circles"


def test_circles_that_drift_on_one_side_are_doubted(
    with_circles: Callable[..., Calibrated],
) -> None:
    drifted = with_circles(lambda x, y: (x + 0.1 * max(0.0, x - 80), y))
    assert any("not where the circles were found" in note for note in drifted.notes)


def test_the_summary_holds_the_new_scores(true: Calibrated) -> None:
    held_out = true.summary(Path("b"))["held_out"]
    assert set(held_out["sphere_radius_ratio"]) == {"median", "iqr"}
    assert set(held_out["sphere_offset_px"]) == {"median", "p90"}
    assert held_out["left_out_size_ratio"] is None
    assert true.bundle.manifest.held_out == held_out


def test_the_circles_cannot_flatter_what_is_said_first(true: Calibrated) -> None:
    assert true.score is not None
    spheres, normals = true.score.sentences(true.coverage())
    assert "radius" in spheres
    assert normals.startswith("held-out normal error")
    assert "slopes up to" in normals


def test_a_single_press_says_that_nothing_was_held_out(lab: VirtualLab) -> None:
    single = calibrated(lab, lab.presses / "press_0.png")
    assert single.score is None
    (note,) = single.notes
    assert "nothing was held out" in note


def test_the_report_shows_every_press_and_the_doubtful_first(
    true: Calibrated, tmp_path: Path
) -> None:
    assert true.score is not None
    true.save(tmp_path / "bundle")
    page = (tmp_path / "bundle" / "report.html").read_text()
    places = [page.index(f"<figcaption>{press.file}") for press in true.presses]
    doubt = [
        max(abs(s.radius_ratio - 1), s.offset_px / BALL_PX)
        for s in (true.score.spheres[i] for i in range(len(true.presses)))
    ]
    by_place = sorted(range(len(places)), key=places.__getitem__)
    assert by_place == sorted(range(len(doubt)), key=doubt.__getitem__, reverse=True)
    assert page.index("Score on held-out presses") < page.index("Coverage")


def test_a_ball_that_is_said_to_be_too_small_is_doubted(lab: VirtualLab) -> None:
    smaller = calibrated(lab, ball_diameter_mm=0.75 * BALL_MM, scored=False)
    assert any("contact is as wide as the ball" in note for note in smaller.notes)


def test_a_single_circle_as_wide_as_the_ball_does_not_contradict_the_others() -> None:
    pixels = np.full((120, 160, 3), 99, np.uint8)
    frame = Frame(pixels, ("red", "green", "blue"), 0.1)
    reference = Reference(pixels.astype(np.float32), frame.channels, 255.0, 1.0, 1)
    gel = load_profile("hex_fingertip_unmarked").gel
    right, wide = (
        FoundPress("press.png", frame, Circle((80.0, 60.0), radius_px), 20.0)
        for radius_px in (14.0, 19.6)
    )
    assert implausible([right] * 23 + [wide], reference, gel) == ()
    (note,) = implausible([right] * 18 + [wide] * 2, reference, gel)
    assert "contact is as wide as the ball in 2 of 20" in note


def test_the_size_whose_presses_are_left_out_is_named() -> None:
    frame = Frame(np.full((120, 160, 3), 99, np.uint8), ("red", "green", "blue"), 0.1)
    reference = Reference(frame.pixels.astype(np.float32), frame.channels, 255.0, 1.0, 1)
    found = FoundPress("press.png", frame, Circle((80.0, 60.0), 14.0), 20.0)
    unlike = replace(found, circle=Circle((80.0, 60.0), 0.0, "not one ball"))
    small = replace(unlike, ball_radius_px=10.0)
    gel = load_profile("hex_fingertip_unmarked").gel
    (note,) = implausible([found] * 10 + [small] * 10, reference, gel)
    assert "only 0 of 10 presses of the ball of 2 mm can be used (not one ball)" in note


def test_presses_that_are_mostly_unusable_are_reported(lab: VirtualLab, tmp_path: Path) -> None:
    folder = tmp_path / "presses"
    shutil.copytree(lab.presses, folder)
    for number in range(11):
        lab.save(folder / f"untouched_{number}.png", None, seed=100 + number)
    few = calibrated(lab, folder, scored=False)
    assert any(
        "only 10 of 21 presses of the ball of 4 mm can be used (no contact" in note
        for note in few.notes
    )


def test_a_contact_deeper_than_the_gel_is_reported(lab: VirtualLab) -> None:
    gel = lab.profile.gel.model_copy(update={"thickness_mm": 0.5})
    thin = calibrate(
        lab.profile.model_copy(update={"gel": gel}),
        lab.presses,
        lab.reference,
        ball_diameter_mm=BALL_MM,
        model="core.polynomial",
        scored=False,
    )
    assert any("deep in a gel of 0.5 mm" in note for note in thin.notes)


def test_markers_at_another_pitch_than_the_profile_contradict_the_scale() -> None:
    rig = RigOptics(load_profile("hex_fingertip"))
    pixels = rig.expose(np.zeros((480, 640)), frame=0).astype(np.float32)
    reference = Reference(pixels, ("red", "green", "blue"), 255.0, 1.0, 1)
    gel = load_profile("hex_fingertip").gel
    frame = Frame(pixels.astype(np.uint8), ("red", "green", "blue"), 0.0276)
    press = FoundPress("press.png", frame, Circle((320.0, 240.0), 30.0), 70.0)
    assert implausible([press], reference, gel) == ()
    coarse = replace(press, frame=replace(frame, mm_per_px=0.04))
    (note,) = implausible([coarse], reference, gel)
    assert "apart at 0.04 mm per pixel" in note
