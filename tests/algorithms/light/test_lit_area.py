"""Dark surroundings of the gel surface are found, and shading is not mistaken for them."""

from __future__ import annotations

import cv2
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_core.algorithms.light.light_change import lit_area

SIZE = (240, 320)


@settings(max_examples=30)
@given(
    left=st.integers(20, 100),
    top=st.integers(20, 70),
    right=st.integers(200, 300),
    bottom=st.integers(150, 220),
)
def test_an_illuminated_window_in_the_dark_is_found(
    left: int, top: int, right: int, bottom: int
) -> None:
    image = np.full((*SIZE, 3), 4, np.uint8)
    image[top:bottom, left:right] = (90, 120, 60)
    found = lit_area(image)
    assert found is not None
    x, y, width, height = found.box
    assert np.abs(np.subtract((x, y, x + width, y + height), (left, top, right, bottom))).max() <= 3
    assert found.taper > 0.95


def test_shading_is_no_dark_frame() -> None:
    x = np.linspace(-1, 1, SIZE[1])
    y = np.linspace(-1, 1, SIZE[0])[:, None]
    vignette = np.broadcast_to(200 * (1 - 0.35 * (x**2 + y**2)), SIZE).astype(np.uint8)
    assert lit_area(vignette) is None


def test_dark_markers_belong_to_the_gel_surface() -> None:
    image = np.full(SIZE, 150, np.uint8)
    image[10::25, 10::25] = 10
    image = cv2.erode(image, np.ones((5, 5), np.uint8))
    assert lit_area(image) is None


def test_a_view_at_an_angle_tapers() -> None:
    image = np.zeros((*SIZE, 3), np.uint8)
    corners = np.array([[40, 30], [280, 30], [240, 210], [80, 210]])
    cv2.fillConvexPoly(image, corners, (120, 130, 140))
    found = lit_area(image)
    assert found is not None
    assert found.taper < 0.85
    x, y, width, height = found.box
    assert (image[y : y + height, x : x + width] > 0).mean() > 0.9


def test_a_dark_image_has_no_area() -> None:
    assert lit_area(np.zeros(SIZE, np.uint8)) is None


def test_a_bright_reflection_alone_is_no_gel_surface() -> None:
    image = np.full(SIZE, 2, np.uint8)
    image[100:110, 100:110] = 255
    assert lit_area(image) is None
