"""Displacement entropy, compared with its definition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.displacement.decomposition import BIN_MM, displacement_entropy
from tactile_core.errors import InputError


def defined(magnitude: np.ndarray) -> float:
    _, counts = np.unique(np.floor(magnitude / BIN_MM), return_counts=True)
    share = counts / counts.sum()
    return float(-(share * np.log2(share)).sum())


@given(st.integers(0, 2**31), st.floats(0.001, 2.0))
def test_the_entropy_equals_its_definition(seed: int, most_mm: float) -> None:
    rng = np.random.default_rng(seed)
    field = rng.uniform(-most_mm, most_mm, (60, 80, 2)).astype(np.float32)
    mask = rng.random((60, 80)) < 0.4
    sizes = np.hypot(*field[mask].T)
    assert displacement_entropy(field, mask) == pytest.approx(defined(sizes), abs=0.01)


def test_subsampling_a_large_contact_gives_the_same_entropy() -> None:
    y, x = np.mgrid[:480, :640]
    size = 0.5 * np.exp(-((x - 300) ** 2 + (y - 200) ** 2) / (2 * 150**2)).astype(np.float32)
    field = np.stack([size, 0 * size], -1)
    mask = np.hypot(x - 300, y - 200) < 200
    assert displacement_entropy(field, mask) == pytest.approx(defined(size[mask]), abs=0.02)


@given(st.floats(0, 3), st.floats(0, 6.28))
def test_uniform_motion_has_no_entropy(size_mm: float, angle: float) -> None:
    field = np.full((9, 9, 2), [size_mm * np.cos(angle), size_mm * np.sin(angle)])
    assert displacement_entropy(field) == 0


@given(st.integers(1, 8))
def test_a_uniform_histogram_has_the_logarithm_of_its_bins(power: int) -> None:
    size = (np.arange(2**power) + 0.5) * BIN_MM
    assert displacement_entropy(np.tile(size, (4, 1))) == pytest.approx(power)


def test_the_bin_width_does_not_depend_on_the_load() -> None:
    ramp = np.tile(np.linspace(0, 0.5, 1000), (4, 1))
    assert displacement_entropy(2 * ramp) == pytest.approx(displacement_entropy(ramp) + 1, abs=0.02)


def test_an_empty_contact_has_no_entropy() -> None:
    assert displacement_entropy(np.ones((5, 5, 2)), np.zeros((5, 5), np.bool_)) == 0


def test_marker_noise_of_a_tenth_of_a_pixel_gives_about_one_and_a_half_bits() -> None:
    from tactile_core.algorithms.displacement.marked_surface import MarkedSurface

    x, y = np.arange(20, 640, 40.0), np.arange(20, 480, 40.0)
    markers = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
    surface = MarkedSurface(markers, (480, 640), mm_per_px=0.0276)
    rng = np.random.default_rng(0)
    sheared = [markers + rng.normal([15, 0], 0.1, markers.shape) for _ in range(10)]
    found = [displacement_entropy(surface.displacement(px, markers[:, 0] > 0)) for px in sheared]
    assert 1.0 < np.mean(found) < 2.0
    assert np.std(found) < 0.2


@pytest.mark.parametrize(
    ("shape", "mask", "bin_mm"),
    [
        ((5, 5, 3), None, BIN_MM),
        ((5, 5), (4, 5), BIN_MM),
        ((5, 5), None, 0.0),
        ((0, 5), None, 1.0),
    ],
)
def test_shapes_that_do_not_match_are_refused(
    shape: tuple[int, ...], mask: tuple[int, int] | None, bin_mm: float
) -> None:
    with pytest.raises(InputError):
        displacement_entropy(
            np.zeros(shape), None if mask is None else np.ones(mask, np.bool_), bin_mm=bin_mm
        )
