"""The kernels of displacement agree with numpy, which is the definition."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.kernel_agreement import AGREES, both_ways, needs_kernels, seeds, several

from tactile_core.algorithms.displacement import MarkedSurface

pytestmark = needs_kernels


@pytest.mark.skipif(cv2.__version__ < "5", reason="this OpenCV rounds the places of samples")
@given(seed=seeds, unseen=st.sampled_from([0.0, 0.1]), radius_px=st.floats(0, 60))
@several
def test_displacements_agree(seed: int, unseen: float, radius_px: float) -> None:
    rng = np.random.default_rng(seed)
    markers = np.stack(np.meshgrid(np.arange(5, 160, 11), np.arange(5, 120, 11)), -1)
    markers = markers.reshape(-1, 2) + rng.uniform(-2, 2, (165, 2))
    y, x = np.mgrid[:120, :160]
    contact = np.hypot(x - 70, y - 50) < radius_px
    far = np.hypot(*(markers - [70, 50]).T)[:, None]
    now = markers + [4, -2] * np.exp(-((far / 30) ** 2)) + rng.normal(0, 0.1, markers.shape)
    seen = rng.random(len(markers)) >= unseen
    fast, plain = both_ways(
        lambda compiled: MarkedSurface(
            markers, (120, 160), mm_per_px=0.1, compiled=compiled
        ).measured(now, seen, contact)
    )
    np.testing.assert_allclose(fast.cells_mm, plain.cells_mm, atol=AGREES)
    np.testing.assert_allclose(fast.std_cells_mm, plain.std_cells_mm, rtol=1e-4, atol=AGREES)
