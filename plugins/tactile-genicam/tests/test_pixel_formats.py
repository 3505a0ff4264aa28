"""Pixels as machine-vision cameras send them."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_genicam.image_source import PIXEL_FORMATS

COLOUR = {"R": 200, "G": 90, "B": 40}


def mosaic(first: str, dtype: type = np.uint8, scale: int = 1) -> np.ndarray:
    """An image sensor under light of one colour; ``first`` names the first row's colours."""
    second = {"RG": "GB", "GR": "BG", "GB": "RG", "BG": "GR"}[first]
    tile = [[scale * COLOUR[colour] for colour in row] for row in (first, second)]
    return np.tile(np.array(tile, dtype), (8, 12))


@pytest.mark.parametrize("bits", [10, 12, 14, 16])
def test_more_than_eight_bits_keep_their_values(bits: int) -> None:
    values = np.linspace(0, 2**bits - 1, 12).astype("<u2").reshape(3, 4)
    form = PIXEL_FORMATS[f"Mono{bits}"]
    assert form.size(3, 4) == 24
    np.testing.assert_array_equal(form.pixels(values.tobytes() + b"more", 3, 4), values)


def test_blue_first_becomes_red_first() -> None:
    data = bytes([10, 20, 30] * 6)
    np.testing.assert_array_equal(PIXEL_FORMATS["BGR8"].pixels(data, 2, 3)[1, 2], (30, 20, 10))
    np.testing.assert_array_equal(PIXEL_FORMATS["RGB8"].pixels(data, 2, 3)[1, 2], (10, 20, 30))


@pytest.mark.parametrize("first", ["RG", "GR", "GB", "BG"])
@pytest.mark.parametrize(("bits", "scale"), [(8, 1), (10, 5), (12, 16), (16, 256)])
def test_a_mosaic_under_one_colour_becomes_that_colour(first: str, bits: int, scale: int) -> None:
    stored = mosaic(first, np.uint8 if bits == 8 else np.uint16, scale)
    pixels = PIXEL_FORMATS[f"Bayer{first}{bits}"].pixels(stored.tobytes(), *stored.shape)
    assert pixels.shape == (16, 24, 3)
    assert (pixels == np.array([scale * COLOUR[colour] for colour in "RGB"])).all()
