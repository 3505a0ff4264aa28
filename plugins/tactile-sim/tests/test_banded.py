"""Products of banded matrices are those of the whole matrices."""

import numpy as np
import pytest

from tactile_sim.refinement import BandedMatrix


@pytest.mark.parametrize("shape", [(480, 92), (80, 480), (130, 128), (1, 1)])
def test_blocks_give_the_product_of_the_whole_matrix(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    row, column = (np.arange(n)[:, None] / n for n in shape)
    matrix = np.where(abs(row - column.T) < 0.05, rng.random(shape), 0)
    field = rng.random((shape[1], 30), np.float32)
    banded = BandedMatrix.from_matrix(matrix)
    np.testing.assert_allclose(banded.times(field), matrix @ field, atol=1e-5)
    np.testing.assert_allclose(banded.along(field.T), (matrix @ field).T, atol=1e-5)
    planes = np.stack([field, 2 * field])
    np.testing.assert_allclose(banded.times(planes), matrix @ planes, atol=2e-5)


def test_rows_of_zeros_give_zeros() -> None:
    field = np.ones((5, 3), np.float32)
    np.testing.assert_array_equal(BandedMatrix.from_matrix(np.zeros((200, 5))).times(field), 0)
