"""Splines through nodes do not depend on how they are evaluated."""

import numpy as np
import pytest

from tactile_core.sim import resampling


@pytest.mark.skipif(not resampling._READS_BETWEEN, reason="this OpenCV rounds positions")
def test_four_linear_interpolations_are_the_cubic_spline(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    coefficients = rng.standard_normal((3, 22, 32), np.float32)
    # some places are beyond the border
    row, column = (rng.uniform(-2, n, (40, 50)).astype(np.float32) for n in (20, 30))
    by_linear = resampling._cubic(coefficients, row, column)
    monkeypatch.setattr(resampling, "_READS_BETWEEN", False)
    np.testing.assert_allclose(by_linear, resampling._cubic(coefficients, row, column), atol=1e-5)
