"""Pictures of shear displacement and markers."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.quantities import Frame
from tactile_core.quantities.fields import Outline, Points, ScalarMap, Surface, VectorMap
from tactile_core.views import overlay
from tactile_core.views.maps import Overlay, colour_field, magnitude, relief
from tactile_core.views.pictures import draw_on_frame, picture_of
from tactile_core.views.shading import Rgb, colours, sequential_colours

SHAPE, SCALE_MM = (480, 640), 0.03
Y, X = np.mgrid[: SHAPE[0], : SHAPE[1]]
ALL = np.ones(SHAPE, np.bool_)


def field(size_mm: float = 0.4, unit: str = "mm") -> VectorMap:
    size = size_mm * np.exp(-(((X - 320) ** 2 + (Y - 240) ** 2) / (2 * 80**2)))
    return VectorMap(np.stack([size, 0 * size], -1).astype(np.float32), ALL, unit, "displacement")


def markers(size_px: float = 0.0, *, seen: bool = True) -> Points:
    at = np.stack(np.meshgrid(np.arange(20, 640, 40.0), np.arange(20, 480, 40.0)), -1)
    at = at.reshape(-1, 2).astype(np.float32)
    return Points(at + np.float32([size_px, 0]), "markers", at, np.full(len(at), seen))


def draw_points(picture: Rgb, points: Points) -> str:
    return overlay.points(picture, points, mm_per_px=SCALE_MM)


def canvas() -> np.ndarray:
    return np.full((*SHAPE, 3), 90, np.uint8)


def red(picture: np.ndarray) -> np.ndarray:
    return (picture[..., 0] > 150) & (picture[..., 1] < 100)


def test_arrows_point_in_the_direction_of_displacement() -> None:
    picture = canvas()
    draw_points(picture, Points(np.float32([[240, 100]]), from_px=np.float32([[200, 100]])))
    drawn = np.argwhere(red(picture))
    assert abs(drawn[:, 0].mean() - 100) < 2
    assert drawn[:, 1].min() > 195
    assert drawn[:, 1].max() == pytest.approx(240, abs=3)


@pytest.mark.parametrize(("size_px", "words"), [(40.0, "×1"), (8.0, "×5"), (1.0, "×10")])
def test_small_displacements_are_magnified_by_a_reported_round_number(
    size_px: float, words: str
) -> None:
    assert draw_points(canvas(), markers(size_px)).endswith(words)


def test_marker_noise_draws_no_arrows() -> None:
    picture = canvas()
    assert draw_points(picture, markers(0.1)) == ""
    assert not red(picture).any()


def test_unseen_markers_are_hollow() -> None:
    seen, unseen = canvas(), canvas()
    draw_points(seen, markers())
    draw_points(unseen, markers(seen=False))
    assert seen[20, 20].max() < 70
    assert unseen[20, 20].min() > 200


def test_all_maps_of_an_image_have_the_size_of_its_relief() -> None:
    height = Surface(np.zeros(SHAPE, np.float32), SCALE_MM)
    over = Overlay([Outline(np.hypot(X - 320, Y - 240) < 60)], [markers(9)], field())
    plain = relief(height, title="press")
    assert relief(height, over).shape == plain.shape
    assert magnitude(field(), over, SCALE_MM).shape == plain.shape
    assert colour_field(ScalarMap(X, "px"), over, SCALE_MM).shape == plain.shape


def test_zero_displacement_has_a_uniform_colour() -> None:
    inside = magnitude(field(0.0), Overlay(), SCALE_MM)[200:400, 200:500].reshape(-1, 3)
    assert np.ptp(inside, axis=0).max() == 0


def test_invalid_parts_of_a_map_are_paler() -> None:
    half = VectorMap(field(0.0).values, X < 320, "mm")
    picture = magnitude(half, Overlay(), SCALE_MM).astype(int)
    assert (picture[250, 550] > picture[250, 100] + 30).any()


def test_arrows_of_a_field_are_on_a_grid() -> None:
    picture = canvas()
    assert overlay.vectors(picture, field(), mm_per_px=SCALE_MM).startswith("arrows")
    assert red(picture).any()


def test_arrows_of_other_units_than_mm_have_no_magnification() -> None:
    small, large = canvas(), canvas()
    for size, picture in ((1e-3, small), (1e3, large)):
        assert overlay.vectors(picture, field(size, "N/mm²"), mm_per_px=SCALE_MM) == ""
    assert red(small).any()
    np.testing.assert_array_equal(small, large)


@pytest.mark.parametrize("values", [0 * X, X < 300, X.astype(np.int32), -1e-6 * X, 1e9 + X])
def test_a_map_of_any_numbers_is_drawn(values: np.ndarray) -> None:
    picture = colour_field(ScalarMap(values, "K", "temperature"), Overlay(), SCALE_MM)
    assert picture.dtype == np.uint8


def test_maps_are_side_by_side_and_points_alone_are_over_the_frame() -> None:
    frame = Frame(np.zeros((*SHAPE, 3), np.uint8), ("r", "g", "b"), SCALE_MM)
    assert picture_of(frame, ()) is None
    assert picture_of(frame, [Outline(ALL)]) is None
    maps = [Surface(0 * field().values[..., 0], SCALE_MM), field(), ScalarMap(X, "px", "place")]
    sheets = [picture_of(frame, [*maps[:count], markers(9)]) for count in range(4)]
    widths = [0 if sheet is None else sheet.shape[1] for sheet in sheets]
    assert widths == sorted(set(widths))


@pytest.mark.parametrize("channels", [1, 2, 3, 6])
def test_markers_are_drawn_over_frames_of_any_channel_count(channels: int) -> None:
    pixels = np.full((120, 160, channels), 30000, np.uint16)
    frame = Frame(pixels, tuple("abcdef"[:channels]), 0.1, 65535)
    picture = draw_on_frame(frame, Overlay(points=[markers(8.0)]), title="press")
    assert picture.dtype == np.uint8
    assert max(picture.shape) >= 640


def test_a_map_has_the_colours_of_its_bar() -> None:
    level = np.linspace(0, 1, 256).astype(np.float32)
    np.testing.assert_array_equal(sequential_colours(level), colours(256))
