"""Implausible balls and labels are refused; a useless calibration comes with a warning."""

from __future__ import annotations

from html import escape
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.builtin.mlp import AutomaticCalibrator
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.result import Calibrated
from tactile_core.errors import CalibrationError, InputError
from tactile_core.interfaces.gel import Gel, Markers
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import read_reference

HEADER = "file,centre_x_px,centre_y_px,contact_radius_px\n"
BALL_PX = BALL_MM / 2 / 0.1245


def labelled(lab: VirtualLab, folder: Path, rows: str) -> Calibrated:
    labels = folder / "labels.csv"
    labels.write_text(HEADER + rows)
    return calibrate(
        lab.profile,
        lab.presses,
        lab.reference,
        ball_diameter_mm=BALL_MM,
        labels=labels,
        model="core.polynomial",
    )


@pytest.mark.parametrize("diameter_mm", [float("inf"), float("nan"), 0, -4, 1e300, 1e9])
def test_an_implausible_diameter_is_refused(lab: VirtualLab, diameter_mm: float) -> None:
    with pytest.raises(InputError, match="--ball-diameter-mm must be positive"):
        calibrate(lab.profile, lab.presses, lab.reference, ball_diameter_mm=diameter_mm)


def test_a_ball_smaller_than_two_pixels_is_refused(lab: VirtualLab) -> None:
    with pytest.raises(InputError, match="smaller than two pixels"):
        calibrate(lab.profile, lab.presses, lab.reference, ball_diameter_mm=1e-9)


@pytest.mark.parametrize("diameter_mm", [float("nan"), 0])
def test_an_implausible_diameter_next_to_a_target_is_refused(
    lab: VirtualLab, tmp_path: Path, diameter_mm: float
) -> None:
    target = tmp_path / "target.yaml"
    target.write_text("radius: 2.0\nshapes: [{type: Circle, x: 80, y: 60}]\n")
    with pytest.raises(InputError, match="--ball-diameter-mm must be positive"):
        calibrate(
            *(lab.profile, lab.presses / "press_0.png", lab.reference),
            target=target,
            ball_diameter_mm=diameter_mm,
        )


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (f"press_1.png,80,60,{1.3 * BALL_PX}", ":3: contact_radius_px 20.88"),
        ("press_1.png,161,60,9", ":3: the circle's centre"),
        ("press_1.png,80,-20,9", ":3: the circle's centre"),
    ],
)
def test_an_implausible_label_is_named_with_its_line(
    lab: VirtualLab, tmp_path: Path, row: str, words: str
) -> None:
    with pytest.raises(InputError, match=r"labels\.csv") as caught:
        labelled(lab, tmp_path, f"press_0.png,80,60,9\n{row}\n")
    assert words in str(caught.value)


def test_a_calibration_that_is_worse_than_none_is_noted_and_reported(
    lab: VirtualLab, tmp_path: Path
) -> None:
    # the presses are elsewhere
    corners = [(6, 6), (153, 6), (6, 113), (153, 113), (80, 4), (80, 115), (4, 60), (155, 60)]
    rows = [f"press_{i}.png,{x},{y},4\n" for i, (x, y) in enumerate(corners)]
    result = labelled(lab, tmp_path, "".join(rows))
    assert result.score is not None
    assert result.score.mean_deg > result.score.predict_flat_deg
    (note,) = result.notes
    assert "do not measure with it" in note
    result.save(tmp_path / "bundle")
    assert escape(note) in (tmp_path / "bundle" / "report.html").read_text()


def test_a_reference_without_the_markers_of_the_profile_is_refused(lab: VirtualLab) -> None:
    gel = Gel(markers=Markers(pitch_mm=1.2, diameter_mm=0.4))
    marked = lab.profile.model_copy(update={"gel": gel})
    message = r"the reference shows \d+ dark markers .* 'markers: null'"
    with pytest.raises(InputError, match=message):
        calibrate(marked, lab.presses, lab.reference, ball_diameter_mm=4.0)
    pipeline = Pipeline(marked, None, read_reference(marked, lab.reference))
    assert any("'markers: null'" in note for note in pipeline.notes)


def lit(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return an image under lights that each fall off in their own way."""
    y, x = np.mgrid[-1 : 1 : image.shape[0] * 1j, -1 : 1 : image.shape[1] * 1j]
    waves = np.sin(np.stack([3 * x + y, 3 * y - x, 2 * x - 3 * y], axis=-1))
    return np.rint(image * (0.85 + 0.12 * waves)).astype(np.uint8)


@pytest.fixture
def recorded(lab: VirtualLab, tmp_path: Path) -> Path:
    for path in [lab.reference, *lab.presses.glob("*.png")]:
        place = tmp_path / path.relative_to(lab.folder)
        place.parent.mkdir(exist_ok=True)
        cv2.imwrite(str(place), lit(np.asarray(cv2.imread(str(path)), np.uint8)))
    return tmp_path


def test_a_press_with_swapped_channels_is_left_out_and_the_mistake_named(
    lab: VirtualLab, recorded: Path
) -> None:
    swapped = recorded / "presses" / "press_0.png"
    cv2.imwrite(str(swapped), np.asarray(cv2.imread(str(swapped)))[..., ::-1])
    inputs = lab.profile, recorded / "presses", recorded / "reference.png"
    made = calibrate(*inputs, ball_diameter_mm=BALL_MM, scored=False)
    why = {press.file: press.why for press in made.presses if not press.used}
    assert set(why) == {"press_0.png"}
    assert "its colour channels are in another order" in why["press_0.png"]


def test_presses_of_a_turned_camera_end_with_what_is_wrong(lab: VirtualLab, recorded: Path) -> None:
    reference = recorded / "reference.png"
    cv2.imwrite(str(reference), np.asarray(cv2.imread(str(reference)))[::-1, ::-1])
    with pytest.raises(CalibrationError, match="turned against the reference"):
        calibrate(lab.profile, recorded / "presses", reference, ball_diameter_mm=BALL_MM)


def test_a_sensor_whose_light_measures_no_slopes_is_not_calibrated(
    lab: VirtualLab, monkeypatch: pytest.MonkeyPatch
) -> None:
    pipeline = Pipeline(lab.profile, None, read_reference(lab.profile, lab.reference))
    assert pipeline.gel_check is not None
    why = "this sensor has pins and no photometry"
    monkeypatch.setattr(AutomaticCalibrator, "refusal", why)
    with pytest.raises(CalibrationError, match=why):
        calibrate(lab.profile, lab.presses, lab.reference, ball_diameter_mm=BALL_MM)
    again = Pipeline(lab.profile, None, read_reference(lab.profile, lab.reference))
    assert again.gel_check is None  # there is no light of a gel to compare
    trained = calibrate(
        lab.profile,
        lab.presses,
        lab.reference,
        ball_diameter_mm=BALL_MM,
        model="core.polynomial",
        scored=False,
    )
    assert trained.bundle.calibration is not None
