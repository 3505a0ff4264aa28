"""A table of gelsight_heightmap_reconstruction gives the slopes of that program, in mm/mm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.colour_profile import colour_profile

from tactile_core import Frame, InputError, Reference
from tactile_imports.bin_table import BinTable, BinTableImporter

Array = np.ndarray[Any, Any]

HEIGHT, WIDTH, MM_PER_PX = 24, 32, 0.0806
NAMES = ("red", "green", "blue")
BINS = 90


def random_table() -> Array:
    """Return steps of the height in mm, up to twice as steep as half a right angle."""
    rng = np.random.default_rng(0)
    return rng.uniform(-2, 2, (BINS, BINS, BINS, 2)) * MM_PER_PX


def imported(folder: Path, table: Array) -> BinTable:
    np.save(folder / "table_smooth.npy", table)
    return BinTableImporter().read(
        folder / "table_smooth.npy", colour_profile(folder, WIDTH, HEIGHT, MM_PER_PX)
    )


@pytest.fixture
def images() -> tuple[Array, Array]:
    """Return a frame and a reference in red, green, blue, whose light falls off to one side."""
    rng = np.random.default_rng(1)
    light = np.linspace(60, 180, WIDTH)[None, :, None] + rng.uniform(-9, 9, (HEIGHT, WIDTH, 3))
    press = rng.uniform(-80, 70, (HEIGHT, WIDTH, 3))
    return np.clip(light + press, 20, 235).astype(np.uint8), light.astype(np.uint8)


def smoothed(image: Array) -> Array:
    """Weigh each pixel by 1/2 and its neighbours by 1/4, along both axes; the border mirrors."""
    for axis in (0, 1):
        padded = np.pad(image, [(1, 1) if axis == each else (0, 0) for each in range(3)], "reflect")
        parts = [np.take(padded, np.arange(image.shape[axis]) + step, axis) for step in range(3)]
        image = parts[0] / 4 + parts[1] / 2 + parts[2] / 4
    return image


def bins_of(image: Array, reference: Array) -> Array:
    """Return (H, W, 3) positions of red, green and blue among the bins, not rounded."""
    light = smoothed(reference.astype(float)) + 1
    weight = 1 + 2 * (light.mean() / light - 1)
    change = (smoothed(image.astype(float)) - light) * weight
    return np.asarray(np.clip((change + 90) / 180, 0, 0.999) * BINS)


def measured(model: BinTable, image: Array, reference: Array, mask: Array | None = None) -> Array:
    gradients = model.measure(
        Frame(image, NAMES, MM_PER_PX),
        Reference(reference.astype(np.float32), NAMES, marker_mask=mask),
    )
    return np.stack([gradients.x, gradients.y], axis=2)


def test_the_table_gives_its_own_slopes(tmp_path: Path, images: tuple[Array, Array]) -> None:
    table = random_table()
    red, green, blue = np.moveaxis(bins_of(*images).astype(int), 2, 0)
    assert len(np.unique(red)) > 30
    expected = table[blue, green, red] / MM_PER_PX
    np.testing.assert_allclose(measured(imported(tmp_path, table), *images), expected, atol=1e-4)


def test_the_height_of_a_slope_rises_by_it_from_pixel_to_pixel(
    tmp_path: Path, images: tuple[Array, Array]
) -> None:
    # a tenth of a millimetre higher from each pixel to the next on its right, whatever the colour
    table = np.zeros((BINS, BINS, BINS, 2))
    table[..., 0] = 0.1
    slopes = measured(imported(tmp_path, table), *images)
    np.testing.assert_allclose(slopes[..., 0] * MM_PER_PX, 0.1, rtol=1e-6)
    np.testing.assert_array_equal(slopes[..., 1], 0)


def test_markers_of_the_reference_are_filled(tmp_path: Path, images: tuple[Array, Array]) -> None:
    table = np.zeros((BINS, BINS, BINS, 2))
    table[..., 0] = np.arange(BINS) * 0.01 * MM_PER_PX  # 0.01 steeper with each bin of red
    model, reference = imported(tmp_path, table), np.full((HEIGHT, WIDTH, 3), 120, np.uint8)
    mask = np.zeros((HEIGHT, WIDTH), bool)
    mask[5:8, 10:13] = True
    marked = np.where(mask[..., None], 30, reference).astype(np.uint8)
    bare = measured(model, images[0], reference)
    assert np.abs(measured(model, images[0], marked) - bare).max() > 0.2
    assert np.abs(measured(model, images[0], marked, mask) - bare).max() < 0.03


def test_a_bundle_measures_as_the_table_that_it_was_made_of(
    tmp_path: Path, images: tuple[Array, Array]
) -> None:
    model = imported(tmp_path, random_table())
    model.save(tmp_path)
    np.testing.assert_array_equal(
        measured(BinTable.load(tmp_path), *images), measured(model, *images)
    )


@pytest.mark.parametrize(
    ("table", "says"),
    [
        (np.zeros((80, 90, 90, 2)), r"is \(80, 90, 90, 2\), not \(90, 90, 90, 2\).*; give the"),
        (np.zeros((90, 90, 90)), r"is \(90, 90, 90\), not"),
        (np.full((90, 90, 90, 2), np.nan), r"other values than finite numbers"),
        (np.zeros((90, 90, 90, 2), int), r"other values than finite numbers"),
    ],
)
def test_another_table_is_one_sentence(tmp_path: Path, table: Array, says: str) -> None:
    with pytest.raises(InputError, match=says) as refused:
        imported(tmp_path, table)
    assert "\n" not in str(refused.value)
