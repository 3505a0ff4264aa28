"""The pitch of a lattice is found from its points."""

import numpy as np

from tactile_core.algorithms.arrays.types import pitch, spacings


def test_the_pitch_is_that_of_most_neighbours() -> None:
    points = np.argwhere(np.ones((5, 6))) * 7.0
    points[0] += 2.0
    assert pitch(points) == 7.0
    assert (spacings(points) < 7.0).sum() >= 2


def test_the_pitch_without_neighbours_is_infinite() -> None:
    assert pitch(np.array([[3.0, 4.0]])) == np.inf
    assert pitch(np.zeros((0, 2))) == np.inf
