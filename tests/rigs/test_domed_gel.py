"""A domed gel: heights relative to its undeformed shape, positions on the curved surface."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from support.domed_gel import DomedPress, photograph, pixels_mm
from support.readings import saved

from tactile_core import ContactMask, Gradients, HeightMap, Pipeline
from tactile_core.builtin.contact import Contact
from tactile_core.builtin.poisson import Poisson
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.result import Calibrated
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.interfaces.sink import Reading
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame

Array = NDArray[Any]

DOME_MM, BALL_MM = 25.0, 2.0
PROFILE = """\
schema: 1
name: domed
image: {width_px: 160, height_px: 120, mm_per_px: 0.1}
gel: {shape: dome, radius_mm: 25}
illumination:
  use: core.constant
  lights:
    - {name: red, azimuth_deg: 90, elevation_deg: 45}
    - {name: green, azimuth_deg: 210, elevation_deg: 45}
    - {name: blue, azimuth_deg: 330, elevation_deg: 45}
optics:
  lights: {distance_mm: 40, scatter: 1.0}
  sensor: {jpeg_quality: none}
estimators:
  height: {use: core.poisson}
  contact: {use: core.contact}
"""


@pytest.fixture(scope="module")
def profile(tmp_path_factory: pytest.TempPathFactory) -> Profile:
    path = tmp_path_factory.mktemp("domed") / "domed.yaml"
    path.write_text(PROFILE)
    return load_profile(path)


def pressed(x_mm: float, y_mm: float) -> DomedPress:
    return DomedPress((x_mm, y_mm), BALL_MM, DOME_MM, contact_mm=1.1)


def sphere(points: Array) -> tuple[Array, float, float]:
    """Centre, radius and RMS distance of the best sphere through (N, 3) points."""
    terms = np.column_stack([2 * points, np.ones(len(points))])
    x, y, z, c = np.linalg.lstsq(terms, (points**2).sum(1), rcond=None)[0]
    centre = np.array([x, y, z])
    radius = float(np.sqrt(c + centre @ centre))
    off = np.linalg.norm(points - centre, axis=1) - radius
    return centre, radius, float(np.sqrt(np.mean(off**2)))


@pytest.fixture(scope="module")
def exact(profile: Profile) -> tuple[DomedPress, Reading]:
    """A reading from true slopes relative to the dome, off the apex."""
    fine = profile.model_copy(
        update={
            "image": profile.image.model_copy(
                update={"width_px": 640, "height_px": 480, "mm_per_px": 0.025}
            )
        }
    )
    context = SensorContext(fine.image, fine.gel)
    press, (x, y) = pressed(3.0, -2.0), pixels_mm(fine)
    gy, gx = np.gradient(press.height_mm(x, y), fine.image.mm_per_px)
    slopes = Gradients(gx.astype(np.float32), gy.astype(np.float32), np.ones(x.shape, bool), 0.025)
    height = Poisson(Poisson.Options(), context).estimate(slopes)
    contact = Contact(Contact.Options(), context).estimate(height)
    frame = Frame(np.zeros((*x.shape, 3), np.uint8), ("r", "g", "b"), 0.025, source="press")
    quantities = {Gradients: slopes, HeightMap: height, ContactMask: contact}
    return press, Reading(frame, quantities, {})


def test_slopes_relative_to_the_dome_give_the_height_above_it(
    exact: tuple[DomedPress, Reading],
) -> None:
    press, reading = exact
    height = reading[HeightMap]
    x, y = height.points_mm[..., 0], height.points_mm[..., 1]
    truth = press.height_mm(x, y)
    # the gel of this drawing hugs the ball and does not bulge, as if a shadow fell beside it
    assert np.abs(height.mm - truth).max() < 0.1 * truth.max()
    assert abs(np.median(height.mm)) < 0.01


def test_the_contact_area_is_that_of_the_ball_and_not_of_the_dome(
    exact: tuple[DomedPress, Reading],
) -> None:
    press, reading = exact
    mask = reading[ContactMask].mask
    x, y = np.moveaxis(reading[HeightMap].points_mm[..., :2], 2, 0)
    touched = press.inside(x, y)
    assert (mask & touched).sum() / (mask | touched).sum() > 0.75
    middle = np.array([x[mask].mean(), y[mask].mean()])
    np.testing.assert_allclose(middle, press.touch_mm, atol=0.05)


def test_the_mesh_of_an_imprint_has_the_radius_and_position_of_the_ball(
    exact: tuple[DomedPress, Reading], tmp_path: Path
) -> None:
    press, reading = exact
    saved(reading, tmp_path, ["ply", "npz"])
    body = (tmp_path / "press.ply").read_bytes().split(b"end_header\n", 1)[1]
    points = np.frombuffer(body, "<f4", 3 * 640 * 480).reshape(-1, 3).astype(float)
    on_ball = press.inside(points[:, 0], points[:, 1])
    centre, radius, off = sphere(points[on_ball])
    assert off < 0.002
    assert radius == pytest.approx(BALL_MM, rel=0.01)
    np.testing.assert_allclose(centre[:2], press.ball_centre_mm, atol=0.005)
    far = np.hypot(points[:, 0] - 3, points[:, 1] + 2) > 5
    centre, radius, off = sphere(points[far])
    assert off < 0.01
    assert radius == pytest.approx(DOME_MM, rel=0.01)
    np.testing.assert_allclose(centre, [0, 0, -DOME_MM], atol=0.2)
    with np.load(tmp_path / "press.npz") as arrays:
        np.testing.assert_array_equal(
            arrays["rest_mm"] - arrays["height_mm"], points[:, 2].reshape(480, 640).astype("f4")
        )


def test_a_flat_gel_has_no_rest_shape() -> None:
    flat = HeightMap(np.ones((3, 4), np.float32), np.ones((3, 4), bool), 0.5)
    assert "rest_mm" not in flat.arrays()
    np.testing.assert_array_equal(flat.points_mm[..., 2], -1)


@pytest.fixture(scope="module")
def calibrated(profile: Profile, tmp_path_factory: pytest.TempPathFactory) -> Calibrated:
    folder = tmp_path_factory.mktemp("presses")
    rng = np.random.default_rng(5)
    for i in range(12):
        press = pressed(*rng.uniform([-5.5, -3.5], [5.5, 3.5]))
        cv2.imwrite(str(folder / f"press_{i:02d}.png"), photograph(profile, press, i)[..., ::-1])
    undeformed = folder.parent / "undeformed_domed.png"
    cv2.imwrite(str(undeformed), photograph(profile, None, 99)[..., ::-1])
    return calibrate(profile, folder, undeformed, ball_diameter_mm=2 * BALL_MM, scored=False)


def test_presses_on_a_dome_are_found_at_the_first_contact(calibrated: Calibrated) -> None:
    rng = np.random.default_rng(5)
    assert sum(press.circle.used for press in calibrated.presses) >= 10
    for press in calibrated.presses:
        touch = rng.uniform([-5.5, -3.5], [5.5, 3.5])
        found = (np.asarray(press.circle.centre_px) - [79.5, 59.5]) * 0.1
        if press.circle.used:
            # a seventieth of the distance from the apex: a press on a slope leans outwards
            np.testing.assert_allclose(found, touch, atol=0.08)


def test_the_ground_truth_of_a_press_on_a_dome_is_the_ball_minus_the_dome(
    calibrated: Calibrated,
) -> None:
    found = next(press for press in calibrated.presses if press.used)
    touch = (np.asarray(found.circle.centre_px) - [79.5, 59.5]) * 0.1
    press = pressed(*touch)
    mask = found.disc(8)
    rows, columns, slopes = found.true_gradients(mask)
    x, y, step = (columns - 79.5) * 0.1, (rows - 59.5) * 0.1, 1e-4
    by_difference = [
        (press.imprint(x + step, y) - press.imprint(x - step, y)) / (2 * step),
        (press.imprint(x, y + step) - press.imprint(x, y - step)) / (2 * step),
    ]
    np.testing.assert_allclose(slopes.T, by_difference, atol=1e-5)
    measured = np.zeros(mask.shape, np.float32)
    measured[mask] = press.imprint(x, y) + 0.2
    np.testing.assert_allclose(found.height_errors_mm(measured, mask), 0, atol=1e-5)


def test_a_calibration_on_a_dome_measures_a_held_out_press(
    profile: Profile, calibrated: Calibrated
) -> None:
    press, (x, y) = pressed(2.0, -1.5), pixels_mm(profile)
    frame = Frame(photograph(profile, press, 77), ("red", "green", "blue"), 0.1, source="unseen")
    height = Pipeline(profile, calibrated.bundle).process(frame)[HeightMap]
    truth = press.height_mm(x, y)
    assert np.sqrt(np.mean((height.mm - truth) ** 2)) < 0.05 * truth.max()
    near = np.hypot(x - 2.0, y + 1.5) < 0.9
    _, radius, _ = sphere(height.points_mm[near].astype(float))
    assert radius == pytest.approx(BALL_MM, rel=0.05)
