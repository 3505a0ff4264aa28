"""The number of markers and their pitch belong together."""

import cv2
import numpy as np
import pytest

from tactile_core.algorithms.markers.count import expected_count, find_detectable_lattice, too_few


def printed(diameter_px: float, pitch_px: float, blur_px: float) -> np.ndarray:
    """A grey image with a lattice of dark, blurred dots."""
    fine = 8
    image = np.full((160 * fine, 200 * fine), 150, np.uint8)
    for y in np.arange(pitch_px / 2, 160, pitch_px):
        for x in np.arange(pitch_px / 2, 200, pitch_px):
            centre = (round(x * fine), round(y * fine))
            cv2.circle(image, centre, round(diameter_px / 2 * fine), 20, -1)
    small = cv2.resize(image, (200, 160), interpolation=cv2.INTER_AREA)
    noisy = cv2.GaussianBlur(small, (0, 0), blur_px).astype(np.float64)
    noisy += np.random.default_rng(0).normal(0, 1, noisy.shape)
    return noisy.clip(0, 255).astype(np.uint8)


def test_a_square_lattice_has_one_marker_per_square_of_its_pitch() -> None:
    assert expected_count((160, 200, 3), 20.0) == 80
    assert not too_few(80, (160, 200), 20.0)
    assert too_few(29, (160, 200), 20.0)


@pytest.mark.parametrize(("diameter_px", "blur_px"), [(6.0, 0.5), (5.0, 1.0), (4.0, 1.5)])
def test_the_diameter_detects_the_markers(diameter_px: float, blur_px: float) -> None:
    found = find_detectable_lattice(printed(diameter_px, 16.0, blur_px))
    assert found is not None
    lattice, count = found
    assert lattice.pitch_px == pytest.approx(16, rel=0.02)
    assert count > 0.9 * expected_count((160, 200), 16.0)


def test_a_bare_gel_has_no_diameter() -> None:
    assert find_detectable_lattice(printed(0.0, 300.0, 1.0)) is None
