"""Signs and units of slopes, heights and contacts on surfaces with known geometry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_core.interfaces.calibration import SlopeErrors
from tactile_core.quantities import ContactMask, Gradients, HeightMap

SHAPE, MM_PER_PX = (30, 40), 0.05
Y, X = (place * MM_PER_PX for place in np.mgrid[: SHAPE[0], : SHAPE[1]])
VALID = np.ones(SHAPE, np.bool_)


def gradients(height_mm: NDArray[np.float64]) -> Gradients:
    gy, gx = np.gradient(height_mm, MM_PER_PX)
    return Gradients(gx.astype(np.float32), gy.astype(np.float32), VALID, MM_PER_PX)


@pytest.mark.parametrize(("along_x", "along_y"), [(0.5, 0.0), (0.0, 0.5), (-0.3, 0.8)])
def test_normals_are_perpendicular_to_the_surface(along_x: float, along_y: float) -> None:
    normals = gradients(along_x * X + along_y * Y).normals
    assert normals @ [1, 0, along_x] == pytest.approx(0, abs=1e-6)
    assert normals @ [0, 1, along_y] == pytest.approx(0, abs=1e-6)
    assert np.linalg.norm(normals, axis=2) == pytest.approx(1, abs=1e-6)
    assert (normals[..., 2] > 0).all()


def test_normals_of_a_ball_point_away_from_its_centre() -> None:
    centre = np.array([1.0, 0.7, -2.0])
    height = centre[2] + np.sqrt(9 - (X - centre[0]) ** 2 - (Y - centre[1]) ** 2)
    radial = np.dstack([X, Y, height]) - centre
    inner = (slice(1, -1), slice(1, -1))  # differences are one-sided at the border
    np.testing.assert_allclose(gradients(height).normals[inner], (radial / 3)[inner], atol=1e-3)


@pytest.mark.parametrize(("calibrated_slope", "warned"), [(0.5, True), (0.8, False), (None, False)])
def test_walls_steeper_than_the_calibration_are_said(
    calibrated_slope: float | None, warned: bool
) -> None:
    groove = gradients(np.clip(abs(X - 1) - 0.4, 0, 0.3) * 0.75)
    said = replace(groove, calibrated_slope=calibrated_slope).warnings()
    assert bool(said) == warned
    assert all("steeper than the 27° that the calibration has seen" in words for words in said)


def test_a_calibrated_sensor_knows_the_steepest_slope_of_its_calibration() -> None:
    slopes, std = np.array([0.1, 0.6], np.float32), np.array([0.02, 0.04], np.float32)
    measured = SlopeErrors(slopes, std, 0.02, 1.5).added_to(gradients(0.3 * X))
    assert measured.calibrated_slope == pytest.approx(0.6)


def test_an_area_is_that_of_its_pixels() -> None:
    mask = np.zeros(SHAPE, np.bool_)
    mask[3:13, 5:25] = True
    assert ContactMask(mask, MM_PER_PX).area_mm2 == pytest.approx(0.5 * 1.0)


@pytest.mark.parametrize("domed", [False, True])
def test_indented_gel_is_nearer_to_the_camera_than_undeformed_gel(domed: bool) -> None:
    rest = (-0.1 * X**2).astype(np.float32) if domed else None
    undeformed, pressed = (
        HeightMap(np.full(SHAPE, mm, np.float32), VALID, MM_PER_PX, rest_mm=rest).points_mm
        for mm in (0.0, 0.3)
    )
    assert undeformed[..., 2] == pytest.approx(0 if rest is None else rest)
    assert (pressed - undeformed)[..., :2] == pytest.approx(0)
    assert (pressed - undeformed)[..., 2] == pytest.approx(-0.3)
    # the image centre is the origin, x right and y down
    assert undeformed[..., 0].mean() == pytest.approx(0, abs=1e-6)
    assert undeformed[0, -1, 0] - undeformed[0, 0, 0] == pytest.approx(39 * MM_PER_PX)
    assert undeformed[-1, 0, 1] - undeformed[0, 0, 1] == pytest.approx(29 * MM_PER_PX)


@pytest.mark.parametrize(("covered", "doubted"), [(0.0, False), (0.8, False), (0.95, True)])
def test_a_contact_that_leaves_no_undeformed_gel_is_doubted(covered: float, doubted: bool) -> None:
    mask = np.arange(4000).reshape(50, 80) < covered * 4000
    warnings = ContactMask(mask, MM_PER_PX).warnings()
    assert bool(warnings) == doubted
    assert not doubted or "covers 95% of the view" in warnings[0]
