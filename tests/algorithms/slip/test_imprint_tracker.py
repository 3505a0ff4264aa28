"""Slip from the imprint: it stays at rest on the gel surface while the object sticks."""

from __future__ import annotations

import csv
import pickle
from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import KDTree
from support.imprint_scenes import MARKER_PX, MARKERS, scene

from tactile_core.algorithms.markers.contrast import marker_mask
from tactile_core.algorithms.markers.count import find_marker_lattice
from tactile_core.algorithms.slip.imprint import SurfaceView
from tactile_core.algorithms.slip.imprint_tracker import ImprintChange, ImprintTracker
from tactile_core.algorithms.slip.state import FUSION, degree_of
from tactile_core.errors import InputError
from tactile_core.formats.images import read_image
from tactile_sim import VirtualStage

MM_PER_PX = 0.05


def track(
    frames: Iterable[tuple[NDArray[np.uint8], NDArray[np.float64]]], step_s: float = 1 / 30
) -> list[ImprintChange]:
    tracker = at_rest()
    return [
        tracker.update(pixels, markers_px, number * step_s)
        for number, (pixels, markers_px) in enumerate(frames)
    ]


def evidence(change: ImprintChange) -> float:
    """Evidence of gross slip where the load is not known."""
    return max(change.changed / FUSION.imprint_changed, change.moved)


def at_rest() -> ImprintTracker:
    """A tracker that has estimated the noise from static frames."""
    tracker = ImprintTracker(*scene(), MARKER_PX, MM_PER_PX)
    for number in range(3):
        tracker.update(*scene(noise=0.3, seed=number), (number - 3) / 30)
    tracker.restart()
    return tracker


@settings(max_examples=10)
@given(st.floats(-12, 12), st.floats(-12, 12))
def test_a_sticking_object_loses_nothing_at_any_shear(x_px: float, y_px: float) -> None:
    ways = [(t * x_px, t * y_px) for t in np.linspace(0, 1, 6)]
    motions = track(scene(way, surface_px=way) for way in ways)
    assert max(evidence(motion) for motion in motions) < 0.5
    assert motions[-1].distance_mm < 2 * motions[-1].distance_std_mm + 0.2 * MM_PER_PX * 2


def test_an_object_that_slides_over_static_gel_slips() -> None:
    motions = track(scene((3.0 * number, 0)) for number in range(8))
    assert motions[0].distance_mm == pytest.approx(0, abs=1e-3)
    assert evidence(motions[-1]) > 1
    assert motions[-1].kind == "translation"


def test_gel_that_slides_under_a_static_object_slips() -> None:
    motions = track(scene(surface_px=(0, -3.0 * number)) for number in range(8))
    assert evidence(motions[-1]) > 1


@pytest.mark.parametrize("way_px", [(3.0, 0.0), (0.0, -3.0), (2.0, 2.0), (9.0, 0.0)])
def test_the_distance_over_the_gel_is_measured(way_px: tuple[float, float]) -> None:
    change = track([scene(), scene(way_px)])[-1]
    assert change.distance_mm == pytest.approx(np.hypot(*way_px) * MM_PER_PX, rel=0.1)
    assert abs(np.degrees(change.turned_rad)) < 0.5


def test_the_distance_adds_up_along_a_slide() -> None:
    change = track(scene((2.0 * number, 0)) for number in range(9))[-1]
    assert change.distance_mm == pytest.approx(16 * MM_PER_PX, abs=2 * change.distance_std_mm)
    assert change.distance_std_mm < 0.3 * change.distance_mm


@pytest.mark.parametrize("turn_deg", [-5.0, 5.0])
def test_rotation_is_distinguished_from_translation(turn_deg: float) -> None:
    motions = track((scene(turn_deg=turn_deg * number / 2) for number in range(3)), step_s=1e-3)
    assert motions[-1].kind == "rotation"
    assert np.degrees(motions[-1].turned_rad) == pytest.approx(turn_deg, rel=0.2)


def test_the_degree_is_a_half_where_slip_begins() -> None:
    assert degree_of(1.0) == pytest.approx(0.5)


@pytest.mark.parametrize(("changed", "slips"), [(0.03, False), (0.05, True)])
def test_slip_begins_where_a_small_share_changed_without_explanation(
    changed: float, slips: bool
) -> None:
    change = ImprintChange(changed, 0.0, 0.0, 0.0, 0.0, 0.1, "translation")
    assert (evidence(change) >= 1) == slips


def test_pressing_harder_is_not_slip() -> None:
    motions = track(scene(depth=depth) for depth in np.linspace(1.0, 2.5, 12))
    assert max(evidence(motion) for motion in motions) < 1


def test_a_lost_object_changes_the_whole_imprint() -> None:
    motions = track([scene(), scene(depth=0.0)])
    assert motions[-1].changed > 0.8


def test_noise_and_illumination_drift_are_not_slip() -> None:
    tracker = ImprintTracker(*scene(), MARKER_PX, MM_PER_PX)
    for number in range(40):
        shown = scene(light=1 + 0.05 * np.sin(number / 5), noise=2.0, seed=number)
        motion = tracker.update(*shown, number / 30)
        assert evidence(motion) < 0.5


def test_a_repeated_frame_does_not_hide_the_noise() -> None:
    tracker = ImprintTracker(*scene(), MARKER_PX, MM_PER_PX)
    for number in range(20):
        shown = scene(noise=2.0, seed=number if number < 10 else 2 * (number // 2))
        motion = tracker.update(*shown, number / 30)
        assert evidence(motion) < 0.5


def test_the_distance_does_not_depend_on_the_frame_rate() -> None:
    ways_mm = [
        track((scene((way, 0)) for way in np.linspace(0, 12, count)), step_s=0.3 / count)[-1]
        for count in (4, 8, 16)
    ]
    np.testing.assert_allclose([way.distance_mm for way in ways_mm], 12 * MM_PER_PX, rtol=0.1)


def test_slip_is_forgotten_when_a_grasp_holds_again_but_its_distance_is_not() -> None:
    tracker = at_rest()
    for number in range(8):
        slid = tracker.update(*scene((3.0 * number, 0)), number / 30)
    held = tracker.update(*scene((21.0, 0)), 10.0)
    assert evidence(slid) > 1
    assert evidence(held) < 0.1
    assert held.distance_mm == pytest.approx(slid.distance_mm, rel=0.01)


def test_a_restart_measures_from_the_present_frame() -> None:
    tracker = at_rest()
    tracker.update(*scene((3.0, 0)), 0.0)
    assert tracker.restart().distance_mm == 0
    change = tracker.update(*scene((3.0, 4.0)), 0.1)
    assert change.distance_mm == pytest.approx(4 * MM_PER_PX, rel=0.1)


def test_the_view_is_at_rest_and_hides_the_markers() -> None:
    view = SurfaceView(*scene(), MARKER_PX)
    still, seen = view.imprint(*scene())
    moved, both = view.imprint(*scene((5, -3), surface_px=(5, -3)))
    assert np.all(still[seen == 0] == 0)
    x, y = np.round(MARKERS / 2 - 0.25).astype(int).T
    assert not seen[y, x].any()
    common = (seen * both) > 0
    assert np.sqrt(np.mean((still - moved)[common] ** 2)) < 0.1 * still[common].std()


@pytest.mark.parametrize("channels", [None, 1, 6])
def test_any_number_of_channels_is_accepted(channels: int | None) -> None:
    def shown(way_px: float) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
        pixels, markers_px = scene((way_px, 0))
        grey = pixels[..., 0]
        return (grey if channels is None else np.dstack([grey] * channels)), markers_px

    tracker = ImprintTracker(*shown(0), MARKER_PX, MM_PER_PX)
    for number in range(10):
        motion = tracker.update(*shown(3.0 * max(number - 1, 0)), number / 30)
    assert evidence(motion) > 1


def test_a_tracker_can_be_pickled() -> None:
    here = ImprintTracker(*scene(), MARKER_PX, MM_PER_PX)
    here.update(*scene(), 0.0)
    there = pickle.loads(pickle.dumps(here))
    assert here.update(*scene((3, 0)), 0.1) == there.update(*scene((3, 0)), 0.1)


def test_reset_forgets_the_object() -> None:
    tracker = at_rest()
    for number in range(8):
        tracker.update(*scene((3.0 * number, 0)), number / 30)
    tracker.reset()
    assert tracker.update(*scene(), 0.5).distance_mm == 0


def test_two_markers_are_refused() -> None:
    with pytest.raises(InputError, match="2 markers"):
        ImprintTracker(scene()[0], MARKERS[:2], MARKER_PX, MM_PER_PX)


@pytest.mark.parametrize(("friction", "slips"), [(3.0, False), (0.3, True)])
def test_a_virtual_coin_slips_at_low_friction_only(friction: float, slips: bool) -> None:
    stage = VirtualStage("hex_fingertip", overrides={"gel": {"friction": friction}})
    pixels, markers_px = stage.frame().pixels, stage.truth().markers_px
    tracker = ImprintTracker(pixels, markers_px, 15.7, stage.profile.image.mm_per_px)
    stage.indenter("coin")
    stage.press(depth_mm=0.15)
    for number in range(16):
        stage.shear(0.04, 0.03)
        motion = tracker.update(stage.frame().pixels, stage.truth().markers_px, number / 30)
    assert (evidence(motion) > 1) == slips


@pytest.mark.parametrize("name", ["object001", "object002", "object003"])
def test_slipping_and_stable_recorded_lifts_are_distinguished(recordings: Path, name: str) -> None:
    folder = recordings / "slip" / "grasp_lift"
    with (folder / "labels.csv").open() as lines:
        rows = [row for row in csv.DictReader(lines) if row["object"] == name]
    for row in (rows[0], rows[-1]):
        degrees = lift(folder / name / f"{row['trial_folder']}_mm")
        assert max(degrees[:6]) < 0.25, "nothing moves before the lift"
        assert (max(degrees) >= 0.5) == (row["label_stable1_slip0"] == "0")


def lift(folder: Path) -> list[float]:
    images = [read_image(path) for path in sorted(folder.glob("*.jpg"))]
    found = find_marker_lattice(images[0])
    assert found is not None
    markers_px = spots(images[0], found.diameter_px)
    tracker = ImprintTracker(images[0], markers_px, found.diameter_px, 0.0276)
    degrees = []
    for number, pixels in enumerate(images):
        seen_px = spots(pixels, found.diameter_px)
        distance, nearest = KDTree(seen_px).query(markers_px)
        step = seen_px[nearest] - markers_px
        step[distance > 0.4 * found.pitch_px] = np.median(step, axis=0)
        markers_px = markers_px + step
        degrees.append(degree_of(evidence(tracker.update(pixels, markers_px, number / 30))))
    return degrees


def spots(pixels: NDArray[np.uint8], diameter_px: float) -> NDArray[np.float64]:
    dark = marker_mask(pixels, diameter_px=diameter_px).astype(np.uint8)
    _, _, stats, centres = cv2.connectedComponentsWithStats(dark)
    return np.asarray(centres[1:][stats[1:, cv2.CC_STAT_AREA] > 0.2 * diameter_px**2])
