"""Pictures of a skin that is dragged."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.quantities import ContactMask, DisplacementField, Frame, HeightMap, MarkerField
from tactile_core.views.overlay import drag
from tactile_core.views.pictures import dragged, marked, relief
from tactile_core.views.shading import colours, painted

SHAPE, SCALE_MM = (480, 640), 0.03
Y, X = np.mgrid[: SHAPE[0], : SHAPE[1]]
ALL = np.ones(SHAPE, np.bool_)


def field(size_mm: float = 0.4) -> DisplacementField:
    magnitude = size_mm * np.exp(-(((X - 320) ** 2 + (Y - 240) ** 2) / (2 * 80**2)))
    mm = np.stack([magnitude, 0 * magnitude], -1).astype(np.float32)
    return DisplacementField(mm, ALL, SCALE_MM)


def marks(size_px: float = 0.0, *, seen: bool = True) -> MarkerField:
    at = np.stack(np.meshgrid(np.arange(20, 640, 40.0), np.arange(20, 480, 40.0)), -1)
    at = at.reshape(-1, 2).astype(np.float32)
    now = at + np.float32([size_px, 0])
    return MarkerField(
        np.arange(len(at), dtype=np.int32), at, now, np.full(len(at), seen), SCALE_MM
    )


def canvas() -> np.ndarray:
    return np.full((*SHAPE, 3), 90, np.uint8)


def red(picture: np.ndarray) -> np.ndarray:
    return (picture[..., 0] > 150) & (picture[..., 1] < 100)


def test_arrows_point_where_the_skin_went() -> None:
    picture = canvas()
    one = MarkerField(
        np.zeros(1, np.int32),
        np.float32([[200, 100]]),
        np.float32([[240, 100]]),
        np.ones(1, np.bool_),
        SCALE_MM,
    )
    drag(picture, one, None)
    drawn = np.argwhere(red(picture))
    assert abs(drawn[:, 0].mean() - 100) < 2
    assert drawn[:, 1].min() > 195
    assert drawn[:, 1].max() == pytest.approx(240, abs=3)


@pytest.mark.parametrize(("size_px", "words"), [(40.0, "×1"), (8.0, "×5"), (1.0, "×10")])
def test_small_motions_are_magnified_by_a_round_number_that_is_told(
    size_px: float, words: str
) -> None:
    assert drag(canvas(), marks(size_px), None).endswith(words)


def test_noise_of_the_marks_gives_no_arrows() -> None:
    picture = canvas()
    assert drag(picture, marks(0.1), None) == ""
    assert not red(picture).any()


def test_marks_that_are_not_seen_are_hollow() -> None:
    seen, unseen = canvas(), canvas()
    drag(seen, marks(), None)
    drag(unseen, marks(seen=False), None)
    assert seen[20, 20].max() < 70
    assert unseen[20, 20].min() > 200


def test_the_map_of_the_magnitude_is_as_large_as_the_relief() -> None:
    height = HeightMap(np.zeros(SHAPE, np.float32), ALL, SCALE_MM)
    contact = ContactMask(np.hypot(X - 320, Y - 240) < 60, SCALE_MM)
    plain = relief(height, contact, title="press")
    assert relief(height, contact, markers=marks(9), field=field()).shape == plain.shape
    assert dragged(field(), contact, markers=marks(9)).shape == plain.shape


def test_skin_at_rest_is_one_even_colour() -> None:
    inside = dragged(field(0.0))[200:400, 200:500].reshape(-1, 3)
    assert np.ptp(inside, axis=0).max() == 0


def test_where_the_field_is_not_valid_the_map_is_paler() -> None:
    half = DisplacementField(field(0.0).mm, X < 320, SCALE_MM)
    picture = dragged(half).astype(int)
    assert (picture[250, 550] > picture[250, 100] + 30).any()


def test_without_marks_the_arrows_stand_on_a_grid() -> None:
    picture = canvas()
    assert drag(picture, None, field()).startswith("arrows")
    assert red(picture).any()


@pytest.mark.parametrize("channels", [1, 2, 3, 6])
def test_marks_are_shown_over_a_frame_of_any_kind(channels: int) -> None:
    pixels = np.full((120, 160, channels), 30000, np.uint16)
    frame = Frame(pixels, tuple("abcdef"[:channels]), 0.1, 65535)
    picture = marked(frame, marks(8.0), title="press")
    assert picture.dtype == np.uint8
    assert max(picture.shape) >= 640


def test_the_colours_of_the_map_are_those_of_its_bar() -> None:
    level = np.linspace(0, 1, 256).astype(np.float32)
    np.testing.assert_array_equal(painted(level), colours(256))
