"""Validation of profile values, independent of files."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from tactile_core.interfaces.component import Component
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection, Lens, Warp

SQUARE = [[0, 0], [240, 0], [0, 320], [240, 320]]
WEDGE = [[33, 58], [208, 61], [56, 250], [185, 244]]
MATRIX = [[600, 0, 320], [0, 600, 240], [0, 0, 1]]


def refused(model: type, message: str, **values: Any) -> None:
    with pytest.raises(ValidationError, match=message):
        model(**values)


def test_a_warp_maps_four_corners_to_four_corners() -> None:
    assert Warp.model_validate({"source": WEDGE, "target": SQUARE}).target[3] == (240, 320)


def test_a_warp_can_mirror_the_image() -> None:
    mirrored = [[240, 0], [0, 0], [240, 320], [0, 320]]
    assert Warp.model_validate({"source": WEDGE, "target": mirrored})


@pytest.mark.parametrize(
    "quad",
    [
        [[0, 0], [1, 1], [2, 2], [3, 3]],
        [[0, 0], [100, 0], [200, 0], [50, 90]],
        [[5, 5], [5, 5], [0, 9], [9, 9]],
        [[0, 0], [0, 0], [0, 0], [0, 0]],
    ],
)
def test_three_collinear_corners_are_rejected(quad: list[list[float]]) -> None:
    refused(Warp, "three of the four corners lie on one line", source=quad, target=SQUARE)
    refused(Warp, "three of the four corners lie on one line", source=WEDGE, target=quad)


def test_corners_in_different_orders_are_rejected() -> None:
    around = [SQUARE[0], SQUARE[1], SQUARE[3], SQUARE[2]]
    refused(Warp, "different order than source", source=WEDGE, target=around)


def test_a_lens_has_a_camera_matrix_and_distortion_coefficients() -> None:
    assert Lens.model_validate({"matrix": MATRIX, "distortion": [0.1, 0, 0, 0, 0]})
    refused(Lens, "4, 5, 8, 12 or 14 numbers, not 6", matrix=MATRIX, distortion=[0.0] * 6)
    for row, column, value in ((0, 0, 0.0), (1, 1, -600), (1, 0, 3), (2, 2, 2)):
        matrix = [list(line) for line in MATRIX]
        matrix[row][column] = value
        refused(Lens, "with fx, fy > 0", matrix=matrix, distortion=[0.0] * 4)


def test_pixels_per_mm_are_detected() -> None:
    size = {"width_px": 640, "height_px": 480}
    assert ImageSection(**size, mm_per_px=0.0276).mm_per_px == 0.0276
    refused(ImageSection, "if this is pixels per mm, write 0.0276", **size, mm_per_px=36.23)


def test_only_a_dome_has_a_radius() -> None:
    assert Gel(shape="dome", radius_mm=20).radius_mm == 20
    refused(Gel, "a dome needs it", shape="dome")
    refused(Gel, "belongs to 'shape: dome'", radius_mm=20)


def test_every_key_of_a_gel_is_optional() -> None:
    assert Gel().model_dump(exclude_none=True) == {"shape": "flat", "coating": "matte"}


def test_a_validated_profile_is_immutable() -> None:
    with pytest.raises(ValidationError):
        Gel().shape = "dome"  # type: ignore[misc]


def test_a_component_keeps_its_options() -> None:
    component = Component.model_validate({"use": "core.replay", "path": "x"})
    assert component.options == {"path": "x"}
