"""What an object prints on the skin stays with the skin while it sticks, and only then."""

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

from tactile_core.algorithms.markers import find_marker_diameter, marker_mask
from tactile_core.algorithms.slip.imprint import ImprintFollower, ImprintMotion
from tactile_core.algorithms.slip.surface_view import SurfaceView
from tactile_core.errors import InputError
from tactile_core.formats.images import read_image
from tactile_core.sim import VirtualStage

pytestmark = pytest.mark.usefixtures("kernels_or_numpy")


def follow(
    frames: Iterable[tuple[NDArray[np.uint8], NDArray[np.float64]]], step_s: float = 1 / 30
) -> list[ImprintMotion]:
    follower = rested()
    return [
        follower.update(pixels, markers_px, number * step_s)
        for number, (pixels, markers_px) in enumerate(frames)
    ]


def rested() -> ImprintFollower:
    """A follower that has seen a moment's rest."""
    follower = ImprintFollower(*scene(), MARKER_PX)
    for number in range(2):
        follower.update(*scene(), (number - 2) / 30)
    return follower


@settings(max_examples=10)
@given(st.floats(-12, 12), st.floats(-12, 12))
def test_an_object_that_sticks_loses_nothing_however_far_it_shears_the_gel(
    x_px: float, y_px: float
) -> None:
    ways = [(t * x_px, t * y_px) for t in np.linspace(0, 1, 6)]
    told = follow(scene(way, surface_px=way) for way in ways)
    assert max(motion.lost for motion in told) < 0.12


def test_an_object_that_slides_over_gel_at_rest_slips() -> None:
    told = follow(scene((3.0 * number, 0)) for number in range(8))
    assert told[0].degree == 0
    assert told[-1].slips
    assert told[-1].kind == "translation"


def test_gel_that_is_sheared_on_under_an_object_at_rest_slips_too() -> None:
    told = follow(scene(surface_px=(0, -3.0 * number)) for number in range(8))
    assert told[-1].slips


@pytest.mark.parametrize("way_px", [(3.0, 0.0), (0.0, -3.0), (2.0, 2.0)])
def test_the_way_over_the_gel_is_measured(way_px: tuple[float, float]) -> None:
    told = follow([scene(), scene(way_px)], step_s=1e-3)
    np.testing.assert_allclose(told[-1].moved_px, way_px, atol=1.0)
    assert abs(told[-1].turned_rad) < 0.01


@pytest.mark.parametrize("turn_deg", [-5.0, 5.0])
def test_a_turn_on_the_gel_is_reported_from_a_slide(turn_deg: float) -> None:
    told = follow((scene(turn_deg=turn_deg * number / 2) for number in range(3)), step_s=1e-3)
    assert told[-1].kind == "rotation"
    assert np.degrees(told[-1].turned_rad) == pytest.approx(turn_deg, rel=0.4)


@pytest.mark.parametrize(("lost", "slips"), [(0.38, False), (0.42, True)])
def test_slip_is_where_two_fifths_of_the_imprint_have_left(lost: float, slips: bool) -> None:
    told = ImprintMotion(lost, 0.1, (0.0, 0.0), 0.0, 30.0)
    assert told.slips == slips
    assert (told.degree > 0.5) == slips


def test_pressing_harder_is_no_slip() -> None:
    told = follow(scene(depth=depth) for depth in np.linspace(1.0, 2.5, 12))
    assert max(motion.lost for motion in told) < 0.05


def test_an_object_taken_away_leaves_all_of_its_imprint() -> None:
    told = follow([scene(), scene(depth=0.0)])
    assert told[-1].lost > 0.8


def test_noise_and_lights_are_no_slip() -> None:
    told = follow(
        scene(light=1 + 0.1 * np.sin(number / 5), noise=2.0, seed=number) for number in range(40)
    )
    assert max(motion.lost for motion in told) < 0.05


def test_what_was_lost_does_not_depend_on_the_rate_of_the_camera() -> None:
    lost = [
        follow((scene((way, 0)) for way in np.linspace(0, 16, count)), step_s=0.3 / count)[-1].lost
        for count in (6, 12, 24)
    ]
    assert max(lost) < 1.6 * min(lost)


def test_a_grasp_that_holds_again_is_forgiven() -> None:
    follower = rested()
    for number in range(8):
        slid = follower.update(*scene((3.0 * number, 0)), number / 30)
    held = follower.update(*scene((21.0, 0)), 10.0)
    assert slid.slips
    assert held.degree < 0.01


def test_the_view_stands_still_and_hides_the_markers() -> None:
    view = SurfaceView(*scene(), MARKER_PX)
    still, seen = view.imprint(*scene())
    moved, both = view.imprint(*scene((5, -3), surface_px=(5, -3)))
    assert np.all(still[seen == 0] == 0)
    x, y = np.round(MARKERS / 2 - 0.25).astype(int).T
    assert not seen[y, x].any()
    common = (seen * both) > 0
    assert np.sqrt(np.mean((still - moved)[common] ** 2)) < 0.1 * still[common].std()


@pytest.mark.parametrize("channels", [None, 1, 6])
def test_images_have_as_many_channels_as_the_camera(channels: int | None) -> None:
    def shown(way_px: float) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
        pixels, markers_px = scene((way_px, 0))
        grey = pixels[..., 0]
        return (grey if channels is None else np.dstack([grey] * channels)), markers_px

    follower = ImprintFollower(*shown(0), MARKER_PX)
    for number in range(10):
        told = follower.update(*shown(3.0 * max(number - 1, 0)), number / 30)
    assert told.slips


def test_a_follower_goes_on_in_another_process() -> None:
    here = ImprintFollower(*scene(), MARKER_PX)
    here.update(*scene(), 0.0)
    there = pickle.loads(pickle.dumps(here))
    assert here.update(*scene((3, 0)), 0.1) == there.update(*scene((3, 0)), 0.1)


def test_reset_forgets_the_object() -> None:
    follower = rested()
    for number in range(8):
        follower.update(*scene((3.0 * number, 0)), number / 30)
    follower.reset()
    assert follower.update(*scene(), 0.5).lost == 0


def test_two_markers_do_not_tell_how_the_gel_moves() -> None:
    with pytest.raises(InputError, match="2 markers"):
        ImprintFollower(scene()[0], MARKERS[:2], MARKER_PX)


@pytest.mark.parametrize(("friction", "slips"), [(3.0, False), (0.3, True)])
def test_a_virtual_coin_slips_where_it_does_not_stick(friction: float, slips: bool) -> None:
    stage = VirtualStage("hex_fingertip", overrides={"gel": {"friction": friction}})
    pixels, markers_px = stage.frame().pixels, stage.truth().markers_px
    follower = ImprintFollower(pixels, markers_px, 15.7)
    stage.indenter("coin")
    stage.press(depth_mm=0.15)
    for number in range(16):
        stage.shear(0.04, 0.03)
        told = follower.update(stage.frame().pixels, stage.truth().markers_px, number / 30)
    assert told.slips == slips


@pytest.mark.parametrize("name", ["object001", "object002", "object003"])
def test_real_lifts_that_slip_are_reported_from_those_that_hold(
    recordings: Path, name: str
) -> None:
    folder = recordings / "slip" / "grasp_lift"
    with (folder / "labels.csv").open() as lines:
        rows = [row for row in csv.DictReader(lines) if row["object"] == name]
    for row in (rows[0], rows[-1]):
        degrees = lift(folder / name / f"{row['trial_folder']}_mm")
        assert max(degrees[:6]) < 0.25, "nothing moves before the lift"
        assert (max(degrees) >= 0.5) == (row["label_stable1_slip0"] == "0")


def lift(folder: Path) -> list[float]:
    images = [read_image(path) for path in sorted(folder.glob("*.jpg"))]
    found = find_marker_diameter(images[0])
    assert found is not None
    markers_px = spots(images[0], found[0])
    follower = ImprintFollower(images[0], markers_px, found[0])
    degrees = []
    for number, pixels in enumerate(images):
        seen_px = spots(pixels, found[0])
        distance, nearest = KDTree(seen_px).query(markers_px)
        step = seen_px[nearest] - markers_px
        step[distance > 0.4 * found[1]] = np.median(step, axis=0)
        markers_px = markers_px + step
        degrees.append(follower.update(pixels, markers_px, number / 30).degree)
    return degrees


def spots(pixels: NDArray[np.uint8], diameter_px: float) -> NDArray[np.float64]:
    dark = marker_mask(pixels, diameter_px=diameter_px).astype(np.uint8)
    _, _, stats, centres = cv2.connectedComponentsWithStats(dark)
    return np.asarray(centres[1:][stats[1:, cv2.CC_STAT_AREA] > 0.2 * diameter_px**2])
