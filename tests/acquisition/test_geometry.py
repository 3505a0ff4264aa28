"""Image geometry follows OpenCV's conventions, and points are mapped like the pixels."""

from __future__ import annotations

import pickle
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_core.acquisition.geometry import ImageGeometry
from tactile_core.errors import InputError
from tactile_core.interfaces.image import ImageSection

SOURCE = ((33.0, 58.0), (208.0, 61.0), (56.0, 250.0), (185.0, 244.0))
TARGET = ((0.0, 0.0), (240.0, 0.0), (0.0, 320.0), (240.0, 320.0))
WARP = {"source": SOURCE, "target": TARGET}
LENS = {
    "matrix": [[210.0, 0, 118.0], [0, 208.0, 163.0], [0, 0, 1]],
    "distortion": [-0.12, 0.03, 0.001, -0.002],
}


def geometry(width: int, height: int, **more: Any) -> ImageGeometry:
    return ImageGeometry(ImageSection(width_px=width, height_px=height, mm_per_px=0.1, **more))


def noise(height: int, width: int, seed: int = 0) -> np.ndarray:
    pixels = np.random.default_rng(seed).integers(0, 255, (height, width, 3), np.uint8)
    return np.asarray(cv2.GaussianBlur(pixels, (0, 0), 2))


def ramps(width: int, height: int) -> np.ndarray:
    """Return an image whose pixels encode their position: 200 x, 150 y and 0."""
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    return np.dstack([200 * x, 150 * y, 0 * x]).astype(np.uint16)


def test_an_identity_geometry_returns_the_input() -> None:
    pixels = noise(12, 16)
    assert geometry(16, 12).apply(pixels) is pixels


def test_a_crop_is_x_y_width_height() -> None:
    pixels = noise(12, 16)
    out = geometry(5, 4, crop=(3, 2, 5, 4)).apply(pixels)
    np.testing.assert_array_equal(out, pixels[2:6, 3:8])
    assert out.flags.c_contiguous


def test_flips_and_rotations_match_numpy() -> None:
    pixels = noise(12, 16)
    for flip, expected in (
        ("horizontal", pixels[:, ::-1]),
        ("vertical", pixels[::-1]),
        ("both", pixels[::-1, ::-1]),
    ):
        np.testing.assert_array_equal(geometry(16, 12, flip=flip).apply(pixels), expected)
    clockwise = geometry(12, 16, rotate_deg=90).apply(pixels)
    np.testing.assert_array_equal(clockwise, np.rot90(pixels, -1))
    np.testing.assert_array_equal(clockwise[0, -1], pixels[0, 0])  # top left goes to top right
    np.testing.assert_array_equal(
        geometry(12, 16, rotate_deg=270).apply(pixels), np.rot90(pixels, 1)
    )


def test_a_flip_precedes_a_rotation() -> None:
    pixels = noise(12, 16)
    out = geometry(12, 16, flip="horizontal", rotate_deg=90).apply(pixels)
    np.testing.assert_array_equal(out, np.rot90(pixels[:, ::-1], -1))


def test_a_warp_matches_opencv() -> None:
    pixels = noise(320, 240)
    matrix = cv2.getPerspectiveTransform(np.float32(SOURCE), np.float32(TARGET))
    expected = cv2.warpPerspective(pixels, matrix, (240, 320))
    out = geometry(240, 320, warp=WARP).apply(pixels)
    assert np.abs(out.astype(int) - expected).max() <= 1


def test_lens_undistortion_matches_opencv() -> None:
    pixels = noise(320, 240)
    expected = cv2.undistort(pixels, np.array(LENS["matrix"]), np.array(LENS["distortion"]))
    out = geometry(240, 320, lens=LENS).apply(pixels)
    assert np.abs(out.astype(int) - expected).max() <= 2


def test_shrinking_averages_and_enlarging_interpolates() -> None:
    pixels = np.zeros((4, 4, 3), np.uint8)
    pixels[::2, ::2] = 200
    np.testing.assert_array_equal(geometry(2, 2).apply(pixels), 50)
    assert geometry(8, 8).apply(pixels).shape == (8, 8, 3)


def test_sixteen_bits_stay_sixteen_bits() -> None:
    pixels = noise(320, 240).astype(np.uint16) * 257
    out = geometry(120, 160, bit_depth=16, lens=LENS).apply(pixels)
    assert out.dtype == np.uint16
    assert out.max() > 255


def test_halving_maps_points_relative_to_pixel_centres() -> None:
    points = np.array([[0.5, 0.5], [10.0, 7.0]])
    mapped = geometry(8, 6).map_points(points, camera_size_px=(16, 12))
    np.testing.assert_allclose(mapped, (points - 0.5) / 2)


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"crop": (20, 30, 200, 260)},
        {"flip": "horizontal"},
        {"flip": "both", "rotate_deg": 90},
        {"rotate_deg": 270, "crop": (10, 20, 180, 240)},
        {"lens": LENS},
        {"warp": WARP},
        {"lens": LENS, "warp": WARP},
        {"crop": (4, 6, 230, 310), "flip": "vertical", "lens": LENS, "warp": WARP},
    ],
    ids=str,
)
def test_points_are_mapped_like_their_pixels(more: dict[str, Any]) -> None:
    for size in ((240, 320), (120, 160)):
        tested = geometry(*size, bit_depth=16, **more)
        image = tested.apply(ramps(240, 320))
        for at in ((60, 70), (45, 90), (80, 55)):
            source = image[at[1], at[0], :2] / (200, 150)
            (mapped,) = tested.map_points([source], camera_size_px=(240, 320))
            np.testing.assert_allclose(mapped, at, atol=0.08)


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(["none", "horizontal", "vertical", "both"]),
    st.sampled_from([0, 90, 180, 270]),
    st.integers(0, 11),
    st.integers(0, 15),
)
def test_points_are_mapped_exactly_by_flips_and_rotations(
    flip: str, turn: int, y: int, x: int
) -> None:
    size = (12, 16) if turn % 180 else (16, 12)
    made = geometry(*size, flip=flip, rotate_deg=turn)
    pixels = np.zeros((12, 16, 3), np.uint8)
    pixels[y, x] = 9
    ((column, row),) = made.map_points([[x, y]])
    assert made.apply(pixels)[int(row), int(column), 0] == 9


def test_mapping_no_points_returns_an_empty_array() -> None:
    assert geometry(240, 320, lens=LENS, warp=WARP).map_points([]).shape == (0, 2)


def test_the_camera_scale_is_derived_from_the_image_scale() -> None:
    assert geometry(8, 6).camera_mm_per_px((16, 12)) == pytest.approx(0.05)
    assert geometry(8, 6, crop=(0, 0, 4, 3)).camera_mm_per_px() == pytest.approx(0.2)
    assert geometry(6, 8, rotate_deg=90).camera_mm_per_px() == pytest.approx(0.1)


def refusal(pixels: np.ndarray, **more: Any) -> str:
    with pytest.raises(InputError) as caught:
        geometry(16, 12, **more).apply(pixels)
    return str(caught.value)


def test_an_image_that_contradicts_the_profile_is_rejected() -> None:
    colour = noise(12, 16)
    assert "16-bit values, but the profile specifies bit_depth: 8" in refusal(
        colour.astype(np.uint16)
    )
    assert "8-bit values" in refusal(colour, bit_depth=16)
    assert "12 bits end at 4095" in refusal(np.full((12, 16, 3), 4096, np.uint16), bit_depth=12)
    assert "color: rgb" in refusal(colour[..., 0])
    assert "color: grey" in refusal(colour, color="grey")
    assert "reaches beyond the camera's 16 × 12" in refusal(colour, crop=(10, 0, 7, 12))


def test_a_grey_image_stored_as_rgb_becomes_grey() -> None:
    grey = noise(12, 16)[..., 0]
    out = geometry(16, 12, color="grey").apply(np.repeat(grey[..., None], 3, axis=2))
    np.testing.assert_array_equal(out, grey)
    assert out.flags.c_contiguous


def test_luma_of_a_colour_image_is_that_of_jpeg_and_a_grey_image_stays() -> None:
    colour = noise(12, 16)
    luma = geometry(16, 12, color="luma").apply(colour)
    np.testing.assert_allclose(luma, colour @ (0.299, 0.587, 0.114), atol=0.51)
    assert luma.dtype == np.uint8
    np.testing.assert_array_equal(geometry(16, 12, color="luma").apply(luma), luma)


def test_a_pickled_geometry_gives_the_same_image() -> None:
    made = geometry(240, 320, warp=WARP)
    pixels = noise(320, 240)
    expected = made.apply(pixels)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(made)).apply(pixels), expected)


def test_the_stretch_is_the_ratio_of_the_resize_factors() -> None:
    section = ImageSection(width_px=160, height_px=120, mm_per_px=0.1)
    assert ImageGeometry(section).stretch((320, 240)) == 1
    assert ImageGeometry(section).stretch((200, 100)) == pytest.approx(2 / 3)
    turned = section.model_copy(update={"rotate_deg": 90})
    assert ImageGeometry(turned).stretch((240, 320)) == 1
    cropped = section.model_copy(update={"crop": (0, 0, 400, 300)})
    assert ImageGeometry(cropped).stretch((640, 360)) == 1


@pytest.mark.parametrize("turned", [0, 90])
def test_the_view_leads_from_the_edges_of_the_image_to_those_before_the_warp(turned: int) -> None:
    crop = (10, 20, 240, 320) if turned == 0 else (20, 10, 320, 240)
    warped = geometry(240, 320, warp=WARP, crop=crop, rotate_deg=turned)
    view = warped.view()
    assert view is not None
    edges = np.array([[-0.5, 0.2, 1], [0.7, -0.3, 1]]) @ view.T
    before = (edges[:, :2] / edges[:, 2:] + 1) * (120, 160) - 0.5
    plain = geometry(240, 320, crop=crop, rotate_deg=turned)
    every = np.stack(np.meshgrid(np.arange(400.0), np.arange(400.0)), -1).reshape(-1, 2)
    camera = [every[np.abs(plain.map_points(every) - point).sum(1).argmin()] for point in before]
    expected = (warped.map_points(camera) + 0.5) / (120, 160) - 1
    np.testing.assert_allclose(expected, [[-0.5, 0.2], [0.7, -0.3]], atol=0.02)


def test_without_a_warp_there_is_no_view_to_lead_to() -> None:
    assert geometry(240, 320, flip="horizontal").view() is None
