"""The compiled quantile agrees with numpy, which is the definition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.kernel_agreement import needs_kernels, seeds, several

from tactile_core.algorithms.arrays.quantile import quantile

pytestmark = needs_kernels


@given(seed=seeds, count=st.integers(1, 600), share=st.floats(0, 1), even=st.booleans())
@several
def test_quantiles_agree(seed: int, count: int, share: float, even: bool) -> None:
    from tactile_core.algorithms.kernels.selection import quantile_of

    values = np.random.default_rng(seed).exponential(1.0, count).astype(np.float32)
    values = np.floor(3 * values) if even else values
    assert quantile_of(values, share) == pytest.approx(quantile(values, share), rel=1e-6)
