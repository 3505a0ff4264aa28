"""The compiled order statistics agree with numpy, which is the definition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.kernel_agreement import needs_kernels, seeds, several

from tactile_core.algorithms.arrays.quantile import quantile
from tactile_core.algorithms.arrays.types import Float64

pytestmark = needs_kernels


@given(seed=seeds, count=st.integers(1, 600), share=st.floats(0, 1), even=st.booleans())
@several
def test_quantiles_agree(seed: int, count: int, share: float, even: bool) -> None:
    from tactile_core.algorithms.kernels.selection import quantile_of

    values = np.random.default_rng(seed).exponential(1.0, count).astype(np.float32)
    # many equal values, or most of them far above the least, as slopes are
    values = np.floor(3 * values) if even else values + np.float32(100) * (values > 0.1)
    assert quantile_of(values, share) == pytest.approx(quantile(values, share), rel=1e-6)


@pytest.mark.parametrize("spread", [1.0, 1e-12, 1e-300, 0.0])
@pytest.mark.parametrize("outlier", [0.0, 1e9, np.inf])
def test_values_are_sorted_however_near_or_far_they_are(spread: float, outlier: float) -> None:
    from numba import njit

    from tactile_core.algorithms.kernels.selection import sort

    @njit
    def in_order(values: Float64) -> Float64:
        ordered = values.copy()
        sort(ordered)
        return ordered

    rng = np.random.default_rng(0)
    for count in (1, 2, 16, 17, 18, 600):
        values = spread * rng.standard_cauchy(count)
        values[count // 2] = outlier
        np.testing.assert_array_equal(in_order(values), np.sort(values))
