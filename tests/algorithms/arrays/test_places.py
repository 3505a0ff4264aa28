"""Pixel coordinates, and the pixels nearest to points."""

import numpy as np

from tactile_core.algorithms.arrays.types import nodes, rasterise_points


def test_a_node_is_its_column_and_its_row() -> None:
    assert nodes((3, 5))[2, 4].tolist() == [4, 2]


def test_points_set_the_nearest_pixel_and_none_outside_the_image() -> None:
    image = rasterise_points(
        np.array([[1.4, 0.0], [-0.6, 1.0], [0.0, 2.6], [4.6, 0.0], [-0.4, 2.4]]), (3, 5)
    )
    assert np.argwhere(image).tolist() == [[0, 1], [2, 0]]
