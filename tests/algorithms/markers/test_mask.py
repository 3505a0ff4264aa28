"""The marker mask, and the search for the diameter and the pitch of printed markers."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactile_core.algorithms.markers.contrast import marker_mask, mask_of
from tactile_core.algorithms.markers.count import find_marker_lattice
from tactile_core.errors import InputError

Array = NDArray[Any]
Bool = NDArray[np.bool_]


def dots(shape: tuple[int, int], pitch_px: float, diameter_px: float) -> Bool:
    y, x = np.mgrid[: shape[0], : shape[1]]
    half = pitch_px / 2
    return np.asarray(np.hypot(x % pitch_px - half, y % pitch_px - half) < diameter_px / 2)


def coloured_light(shape: tuple[int, int]) -> Array:
    """Three lights, each falling off across the gel surface to a third of its intensity."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    u, v = x / shape[1], y / shape[0]
    return np.stack([90 + 90 * u, 180 - 110 * v, 150 - 80 * u + 40 * v], axis=2)


def photograph(light: Array, markers: Bool, *, ink: float = 0.3, seed: int = 0) -> Array:
    shade = cv2.GaussianBlur(np.where(markers, ink, 1.0), (0, 0), 0.7)
    noise = np.random.default_rng(seed).normal(0, 1.5, light.shape)
    return np.asarray(np.clip(np.rint(light * shade[..., None] + noise), 0, 255), np.uint8)


def eroded(mask: Bool, px: int) -> Bool:
    kernel = np.ones((2 * px + 1,) * 2, np.uint8)
    return np.asarray(cv2.erode(mask.view(np.uint8), kernel) > 0)


def dilated(mask: Bool, px: int) -> Bool:
    return ~eroded(~mask, px)


@settings(max_examples=20, deadline=None)
@given(st.floats(4, 26), st.floats(0.2, 0.6), st.integers(0, 2**32 - 1))
def test_the_mask_covers_markers_and_their_rim_only(
    diameter_px: float, ink: float, seed: int
) -> None:
    markers = dots((240, 320), 3.5 * diameter_px, diameter_px)
    image = photograph(coloured_light(markers.shape), markers, ink=ink, seed=seed)
    mask = marker_mask(image, diameter_px=diameter_px)
    assert mask.dtype == bool
    assert mask[markers].mean() > 0.99
    assert not (mask & ~dilated(markers, 6)).any()


@pytest.mark.parametrize("times", [1, 2, 3])
def test_the_rim_is_a_pixel_of_the_image(times: int) -> None:
    contrast = np.random.default_rng(0).choice([0, 255], (12, 17), p=[0.9, 0.1]).astype(np.uint8)
    enlarged = np.kron(contrast, np.ones((times, times), np.uint8))
    mask = mask_of(contrast, enlarged.shape)
    assert (mask == dilated(enlarged > 0, 1)).all()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_the_mask_does_not_depend_on_the_dtype(dtype: type) -> None:
    markers = dots((120, 160), 30, 10)
    image = photograph(coloured_light(markers.shape), markers)
    scale = 16 if dtype is np.uint16 else 1
    mask = marker_mask((image.astype(np.float64) * scale).astype(dtype), diameter_px=10)
    agree = mask == marker_mask(image, diameter_px=10)
    assert agree.mean() > 0.998


def test_a_single_channel_is_enough() -> None:
    markers = dots((120, 160), 30, 10)
    image = photograph(coloured_light(markers.shape), markers)[..., :1]
    assert marker_mask(image, diameter_px=10)[markers].all()
    assert marker_mask(image[..., 0], diameter_px=10)[markers].all()


def test_the_shading_of_a_contact_is_not_masked() -> None:
    y, x = np.mgrid[:240, :320] - np.array([120, 160])[:, None, None]
    r = np.hypot(x, y)
    slope = np.where(r < 50, r / 60, 50 / 60 * np.exp(-(r - 50) / 15)) / np.maximum(r, 1e-9)
    angle = np.radians([90, 210, 330])
    shading = (np.cos(angle) * x[..., None] + np.sin(angle) * y[..., None]) * slope[..., None]
    image = photograph(120 + 90 * shading, np.zeros(r.shape, bool))
    assert marker_mask(image, diameter_px=12).mean() < 0.005


@settings(max_examples=10, deadline=None)
@given(st.floats(4, 16), st.floats(2.5, 3.5), st.integers(0, 2**32 - 1))
def test_diameter_and_pitch_are_found(diameter_px: float, ratio: float, seed: int) -> None:
    markers = dots((240, 320), ratio * diameter_px, diameter_px)
    found = find_marker_lattice(photograph(coloured_light(markers.shape), markers, seed=seed))
    assert found is not None
    assert found.diameter_px == pytest.approx(diameter_px, rel=0.2, abs=0.7)
    assert found.pitch_px == pytest.approx(ratio * diameter_px, rel=0.03)


def test_an_unmarked_gel_has_no_lattice() -> None:
    bare = photograph(coloured_light((240, 320)), np.zeros((240, 320), bool))
    assert find_marker_lattice(bare) is None
    assert find_marker_lattice(np.zeros((20, 30, 3), np.uint8)) is None


@pytest.mark.parametrize("ratio", [1.2, 1.3])
def test_spots_that_nearly_touch_are_not_a_lattice(ratio: float) -> None:
    size_px = 10
    y, x = ((side % (ratio * size_px)) - ratio * size_px / 2 for side in np.mgrid[:240, :320])
    weave = np.where(np.hypot(x, y) < size_px / 2, 60, 160).astype(np.float32)
    assert find_marker_lattice(cv2.GaussianBlur(weave, (0, 0), 0.7).astype(np.uint8)) is None


def test_random_specks_are_not_a_lattice() -> None:
    markers = np.zeros((240, 320), bool)
    rng = np.random.default_rng(0)
    for x, y in rng.uniform(10, 230, (60, 2)):
        yy, xx = np.mgrid[:240, :320]
        markers |= np.hypot(xx - x, yy - y) < 4
    assert find_marker_lattice(photograph(coloured_light(markers.shape), markers)) is None


@pytest.mark.parametrize("call", [find_marker_lattice, lambda p: marker_mask(p, diameter_px=5)])
def test_an_array_that_is_not_an_image_is_refused(call: Any) -> None:
    with pytest.raises(InputError, match="an image is"):
        call(np.zeros(5, np.uint8))


def test_a_diameter_of_zero_is_refused() -> None:
    with pytest.raises(InputError, match="positive diameter"):
        marker_mask(np.zeros((5, 5), np.uint8), diameter_px=0)


def read(path: Path) -> Array:
    image = cv2.imread(str(path))
    assert image is not None, path
    return np.asarray(image[..., ::-1])


def spots(mask: Bool, least_px: int) -> Iterator[Array]:
    _, _, stats, centres = cv2.connectedComponentsWithStats(mask.view(np.uint8))
    for (x, y, width, height, area), centre in zip(stats[1:], centres[1:], strict=True):
        inside = x > 0 and y > 0 and x + width < mask.shape[1] and y + height < mask.shape[0]
        if inside and area >= least_px:
            yield centre


@pytest.mark.recordings
def test_the_markers_of_the_hexagonal_fingertip_are_found(recordings: Path) -> None:
    folder = recordings / "three_colour" / "hex_fingertip"
    found = find_marker_lattice(read(folder / "frame0.jpg"))
    assert found is not None
    assert found.pitch_px == pytest.approx(1.71 / 0.03026, rel=0.03)
    for path in sorted(folder.glob("*.jpg")):
        mask = marker_mask(read(path), diameter_px=found.diameter_px)
        assert 72 <= len(list(spots(mask, 80))) <= 95
        assert mask.mean() < 0.12


@pytest.mark.recordings
def test_the_markers_of_the_pressed_wedge_are_found(recordings: Path) -> None:
    folder = recordings / "three_colour" / "wedge"
    source = np.array([[33, 58], [208, 61], [56, 250], [185, 244]], np.float32)
    target = np.array([[0, 0], [240, 0], [0, 320], [240, 320]], np.float32)
    warp = cv2.getPerspectiveTransform(source, target)
    names = ["bg-0.jpg", "ball-7.jpg", "ball-20.jpg"]
    images = [cv2.warpPerspective(read(folder / name), warp, (240, 320)) for name in names]
    found = find_marker_lattice(images[0])
    assert found is not None
    assert found.pitch_px == pytest.approx(19.6, rel=0.03)
    for image in images:
        inner = marker_mask(image, diameter_px=found.diameter_px)[8:-8, 8:-8]
        assert len(list(spots(inner, 12))) == pytest.approx(140, abs=8)


@pytest.mark.recordings
@pytest.mark.parametrize(
    "path",
    [
        "three_colour/objectfolder/reference.png",
        "gelsight_mini/background.png",
        "gelsight_mini/key.png",
        "force/grip/wedge_config/init_frame.png",
    ],
)
def test_unmarked_gels_have_no_lattice(recordings: Path, path: str) -> None:
    assert find_marker_lattice(read(recordings / path)) is None
