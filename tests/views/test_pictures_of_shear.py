"""Pictures of a skin that is dragged."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.quantities import Frame
from tactile_core.quantities.layers import Outline, Points, ScalarMap, Surface, VectorMap
from tactile_core.views import overlay
from tactile_core.views.drawing import Rgb
from tactile_core.views.maps import Over, coloured, magnitude, relief
from tactile_core.views.pictures import marked, picture_of
from tactile_core.views.shading import colours, painted

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


def shear(picture: Rgb, points: Points) -> str:
    return overlay.points(picture, points, mm_per_px=SCALE_MM)


def canvas() -> np.ndarray:
    return np.full((*SHAPE, 3), 90, np.uint8)


def red(picture: np.ndarray) -> np.ndarray:
    return (picture[..., 0] > 150) & (picture[..., 1] < 100)


def test_arrows_point_where_the_gel_went() -> None:
    picture = canvas()
    shear(picture, Points(np.float32([[240, 100]]), from_px=np.float32([[200, 100]])))
    drawn = np.argwhere(red(picture))
    assert abs(drawn[:, 0].mean() - 100) < 2
    assert drawn[:, 1].min() > 195
    assert drawn[:, 1].max() == pytest.approx(240, abs=3)


@pytest.mark.parametrize(("size_px", "words"), [(40.0, "×1"), (8.0, "×5"), (1.0, "×10")])
def test_small_motions_are_magnified_by_a_round_number_that_is_reported(
    size_px: float, words: str
) -> None:
    assert shear(canvas(), markers(size_px)).endswith(words)


def test_noise_of_the_markers_gives_no_arrows() -> None:
    picture = canvas()
    assert shear(picture, markers(0.1)) == ""
    assert not red(picture).any()


def test_markers_that_are_not_seen_are_hollow() -> None:
    seen, unseen = canvas(), canvas()
    shear(seen, markers())
    shear(unseen, markers(seen=False))
    assert seen[20, 20].max() < 70
    assert unseen[20, 20].min() > 200


def test_every_map_of_an_image_is_as_large_as_its_relief() -> None:
    height = Surface(np.zeros(SHAPE, np.float32), SCALE_MM)
    over = Over([Outline(np.hypot(X - 320, Y - 240) < 60)], [markers(9)], field())
    plain = relief(height, title="press")
    assert relief(height, over).shape == plain.shape
    assert magnitude(field(), over, SCALE_MM).shape == plain.shape
    assert coloured(ScalarMap(X, "px"), over, SCALE_MM).shape == plain.shape


def test_a_surface_at_rest_is_one_even_colour() -> None:
    inside = magnitude(field(0.0), Over(), SCALE_MM)[200:400, 200:500].reshape(-1, 3)
    assert np.ptp(inside, axis=0).max() == 0


def test_where_the_field_is_not_valid_the_map_is_paler() -> None:
    half = VectorMap(field(0.0).values, X < 320, "mm")
    picture = magnitude(half, Over(), SCALE_MM).astype(int)
    assert (picture[250, 550] > picture[250, 100] + 30).any()


def test_without_points_the_arrows_stand_on_a_grid() -> None:
    picture = canvas()
    assert overlay.vectors(picture, field(), mm_per_px=SCALE_MM).startswith("arrows")
    assert red(picture).any()


def test_arrows_of_another_unit_than_mm_have_no_scale() -> None:
    small, large = canvas(), canvas()
    for size, picture in ((1e-3, small), (1e3, large)):
        assert overlay.vectors(picture, field(size, "N/mm²"), mm_per_px=SCALE_MM) == ""
    assert red(small).any()
    np.testing.assert_array_equal(small, large)


@pytest.mark.parametrize("values", [0 * X, X < 300, X.astype(np.int32), -1e-6 * X, 1e9 + X])
def test_a_map_of_any_numbers_is_drawn(values: np.ndarray) -> None:
    picture = coloured(ScalarMap(values, "K", "temperature"), Over(), SCALE_MM)
    assert picture.dtype == np.uint8


def test_a_picture_shows_each_map_beside_the_others_and_points_alone_over_the_frame() -> None:
    frame = Frame(np.zeros((*SHAPE, 3), np.uint8), ("r", "g", "b"), SCALE_MM)
    assert picture_of(frame, ()) is None
    assert picture_of(frame, [Outline(ALL)]) is None
    maps = [Surface(0 * field().values[..., 0], SCALE_MM), field(), ScalarMap(X, "px", "place")]
    sheets = [picture_of(frame, [*maps[:count], markers(9)]) for count in range(4)]
    widths = [0 if sheet is None else sheet.shape[1] for sheet in sheets]
    assert widths == sorted(set(widths))


@pytest.mark.parametrize("channels", [1, 2, 3, 6])
def test_markers_are_shown_over_a_frame_of_any_kind(channels: int) -> None:
    pixels = np.full((120, 160, channels), 30000, np.uint16)
    frame = Frame(pixels, tuple("abcdef"[:channels]), 0.1, 65535)
    picture = marked(frame, [markers(8.0)], title="press")
    assert picture.dtype == np.uint8
    assert max(picture.shape) >= 640


def test_the_colours_of_the_map_are_those_of_its_bar() -> None:
    level = np.linspace(0, 1, 256).astype(np.float32)
    np.testing.assert_array_equal(painted(level), colours(256))
