"""What a frame computes of its pixels, and keeps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tactile_core.algorithms.markers.contrast import contrast_of
from tactile_core.algorithms.slip.imprint import SurfaceView
from tactile_core.quantities import Frame


def frame_of(shape: tuple[int, ...] = (240, 320, 3), dtype: type = np.uint8) -> Frame:
    pixels = np.random.default_rng(0).integers(0, 256, shape).astype(dtype)
    return Frame(pixels, tuple("abcdef"[: shape[2]]), 0.1)


def test_halves_are_rounded_means_over_four_pixels() -> None:
    frame = frame_of((4, 6, 3))
    blocks = frame.pixels.reshape(2, 2, 3, 2, 3).sum(axis=(1, 3), dtype=np.int64)
    np.testing.assert_array_equal(frame.halves, (blocks + 2) // 4)


@pytest.mark.parametrize(
    ("shape", "dtype"), [((5, 6, 3), np.uint8), ((4, 6, 6), np.uint8), ((4, 6, 3), np.float32)]
)
def test_only_colour_images_of_bytes_and_even_sides_have_halves(
    shape: tuple[int, ...], dtype: type
) -> None:
    assert frame_of(shape, dtype).halves is None


def test_what_follows_from_the_pixels_is_kept_beside_other_values() -> None:
    frame = frame_of()
    halves, share = frame.halves, frame.saturated_share
    marked = frame.beside(marker_mask=np.zeros((240, 320), np.bool_))
    assert marked.marker_mask is not None
    assert vars(marked)["halves"] is halves
    assert vars(marked)["saturated_share"] == share


def test_other_pixels_have_other_halves() -> None:
    frame = frame_of()
    assert frame.halves is not None
    dark = replace(frame, pixels=np.zeros_like(frame.pixels))
    assert dark.halves is not None
    assert not dark.halves.any()


@pytest.mark.parametrize("diameter_px", [13.0, 25.0])
def test_the_contrast_of_halves_is_that_of_the_image(diameter_px: float) -> None:
    frame = frame_of((480, 640, 3))
    whole = contrast_of(frame.pixels, diameter_px=diameter_px)
    halved = contrast_of(frame.pixels, diameter_px=diameter_px, halves=frame.halves)
    np.testing.assert_array_equal(halved, whole)


@pytest.mark.parametrize("shape", [(240, 320, 3), (480, 640, 3)])
def test_the_imprint_in_halves_is_that_in_the_image(shape: tuple[int, ...]) -> None:
    frame = frame_of(shape)
    markers = 24.0 * np.stack(np.meshgrid(np.arange(1, 12), np.arange(1, 9)), -1).reshape(-1, 2)
    view = SurfaceView(frame.pixels, markers, 8.0)
    whole, _ = view.imprint(frame.pixels, markers + 0.3)
    halved, _ = view.imprint(frame.pixels, markers + 0.3, frame.halves)
    np.testing.assert_allclose(halved, whole, rtol=0, atol=1e-6)
