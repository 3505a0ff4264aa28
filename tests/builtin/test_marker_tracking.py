"""``core.marker_tracking``: displacement, tare, and messages when tracking fails."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactile_core.builtin.contact import MarkerTracking
from tactile_core.errors import InputError, ProfileError
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import MarkerDetections, MarkerField, Reference

PITCH = 20.0
PLACES = PITCH * (1 + np.stack(np.meshgrid(np.arange(10), np.arange(8)), -1).reshape(-1, 2))
CONTEXT = SensorContext(ImageSection(width_px=220, height_px=180, mm_per_px=0.05), Gel())


def shown(places: np.ndarray, cut: np.ndarray | None = None) -> MarkerDetections:
    cut = np.zeros(len(places), np.bool_) if cut is None else cut
    return MarkerDetections(places.astype(np.float32), cut, 1.5)


def reference(places: np.ndarray = PLACES, cut: np.ndarray | None = None) -> Reference:
    pixels = np.zeros((180, 220, 3), np.float32)
    return Reference(pixels, ("red", "green", "blue"), detections=shown(places, cut))


@pytest.fixture
def step() -> MarkerTracking:
    return MarkerTracking(MarkerTracking.Options(), CONTEXT)


def test_displacement_is_in_millimetres_since_the_reference(step: MarkerTracking) -> None:
    field = step.estimate(shown(PLACES + np.array([4.0, -2.0])), reference())
    assert field.displacement_mm == pytest.approx(np.tile([0.2, -0.1], (80, 1)), abs=1e-5)
    assert field.seen.all()
    assert field.timestamp_s == 1.5


def test_after_missing_frames_the_tare_stays_and_the_markers_are_identified_again(
    step: MarkerTracking,
) -> None:
    loaded = PLACES + np.array([5.0, 0.0])
    step.tare(step.estimate(shown(loaded), reference()))
    for _ in range(2):
        step.resume()
    step.resume()
    moved = step.estimate(shown(loaded + np.array([0.0, 3.0])), reference())
    assert moved.displacement_mm == pytest.approx(np.tile([0.0, 0.15], (80, 1)), abs=1e-5)
    step.resume()
    other = step.estimate(shown(loaded), reference(PLACES + 1))
    assert other.displacement_mm == pytest.approx(np.tile([0.2, -0.05], (80, 1)), abs=1e-5)


def test_after_a_tare_displacement_is_since_then(step: MarkerTracking) -> None:
    step.estimate(shown(PLACES), reference())
    loaded = PLACES + np.array([5.0, 0.0])
    still = step.tare(step.estimate(shown(loaded), reference()))
    moved = step.estimate(shown(loaded + np.array([0.0, 3.0])), reference())
    assert np.abs(still.displacement_mm).max() < 1e-6
    assert moved.displacement_mm == pytest.approx(np.tile([0.0, 0.15], (80, 1)), abs=1e-5)
    assert moved.undeformed_px == pytest.approx(PLACES)
    step.reset()
    again = step.estimate(shown(loaded), reference())
    assert again.displacement_mm == pytest.approx(np.tile([0.25, 0.0], (80, 1)), abs=1e-5)


def test_markers_truncated_in_the_reference_are_not_reported(step: MarkerTracking) -> None:
    cut = PLACES[:, 0] == PLACES[:, 0].min()
    assert len(step.estimate(shown(PLACES), reference(cut=cut)).ids) == 72


def test_a_frame_without_enough_markers_gives_a_warning(step: MarkerTracking) -> None:
    step.estimate(shown(PLACES), reference())
    field = step.estimate(shown(PLACES[:2]), reference())
    assert not field.seen.any()
    assert any("none of the 80 markers" in warning for warning in field.warnings())
    assert step.estimate(shown(PLACES), reference()).seen.all()


def test_a_start_in_contact_is_reported_once(step: MarkerTracking) -> None:
    far = np.square(PLACES - PLACES.mean(axis=0)).sum(axis=1, keepdims=True)
    pressed = PLACES + 0.3 * (PLACES - PLACES.mean(axis=0)) * np.exp(-far / 40**2)
    first = step.estimate(shown(pressed), reference())
    second = step.estimate(shown(pressed), reference())
    assert first.started_in_contact
    assert second.started_in_contact
    assert any("touched" in warning for warning in first.warnings())
    assert not second.warnings()


def test_a_reference_without_markers_is_refused(step: MarkerTracking) -> None:
    with pytest.raises(InputError, match="the reference shows 0 markers"):
        step.estimate(shown(PLACES), reference(PLACES[:0]))


def profile(folder: Path, name: str, text: str) -> Path:
    path = folder / f"{name}.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_revision_without_markers_leaves_the_inherited_step_out(tmp_path: Path) -> None:
    step = "estimators: {tracking: {use: core.marker_tracking}}\n"
    profile(tmp_path, "marked", f"extends: hex_fingertip\nname: marked\n{step}")
    bare = "extends: marked.yaml\nname: bare\ngel: {markers: null}\n"
    pipeline = Pipeline(load_profile(profile(tmp_path, "bare", bare)))
    assert "tracking" not in [step.name for step in pipeline.steps]
    assert any("no markers" in note and "tracking" in note for note in pipeline.notes)


@pytest.mark.parametrize("step", ["markers", "marker_tracking", "displacement"])
def test_a_step_that_needs_markers_is_refused_for_a_gel_without_them(
    tmp_path: Path, step: str
) -> None:
    text = (
        "extends: hex_fingertip\nname: bare\ngel: {markers: null}\n"
        f"estimators:\n  {step}: {{use: core.{step}}}\n"
    )
    place = rf"bare\.yaml:5:{len(step) + 6}: estimators\.{step}\.use"
    where = rf"{place}: core\.{step} needs printed markers"
    with pytest.raises(ProfileError, match=where):
        load_profile(profile(tmp_path, "bare", text))


def test_a_field_is_saved_under_the_names_of_the_contract(step: MarkerTracking) -> None:
    field = step.estimate(shown(PLACES), reference())
    assert isinstance(field, MarkerField)
    assert set(field.arrays()) > {
        "markers_px",
        "marker_ids",
        "marker_reference_px",
        "marker_displacement_mm",
        "marker_seen",
    }
    assert field.summary() == {"markers": {"seen": 80, "expected": 80}}
