"""Planes of images as the input of a network."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_networks.planes import normalise_planes, shrunk_planes, tensor


@given(st.integers(1, 4), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_shrinking_by_area_averages_blocks(rows: int, columns: int, seed: int) -> None:
    pixels = np.random.default_rng(seed).integers(0, 256, (6 * rows, 5 * columns, 3), np.uint8)
    blocks = pixels.reshape(6, rows, 5, columns, 3).mean((1, 3))
    found = shrunk_planes(pixels, (5, 6))
    assert found.dtype == np.float32
    assert found == pytest.approx(blocks, abs=1e-3)


def test_heights_become_one_plane_and_displacements_two() -> None:
    assert shrunk_planes(np.zeros((4, 8), np.float32), (4, 2)).shape == (2, 4, 1)
    assert shrunk_planes(np.zeros((2, 2, 2), np.float32), (8, 4)).shape == (4, 8, 2)


def test_each_plane_has_its_own_normalisation() -> None:
    planes = np.full((2, 3, 2), 6, np.float32)
    found = normalise_planes(planes, np.array([2, 3], np.float32), [1.0, 1.0], [2.0, 0.5])
    assert found[0, 0] == pytest.approx([1.0, 2.0])


def test_the_order_of_the_axes_is_the_networks() -> None:
    groups = [np.zeros((2, 3, 1), np.float32), np.ones((2, 3, 2), np.float32)]
    assert tensor(groups).shape == (1, 3, 2, 3)
    assert tensor(groups)[0, :, 0, 0] == pytest.approx([0, 1, 1])
    assert tensor(groups, "nhwc").shape == (1, 2, 3, 3)
    assert tensor(groups).flags.c_contiguous
