"""The kernels of levelling agree with numpy, which is the definition."""

from __future__ import annotations

import numpy as np
import pytest
from support.kernel_agreement import AGREES, MM_PER_PX, both_ways, needs_kernels, press

from tactile_core.algorithms.rest_area import height_error

pytestmark = needs_kernels


@pytest.mark.parametrize("shape", [(120, 160), (97, 131), (12, 9)])
@pytest.mark.parametrize("tilt", [0.0, 0.03])
def test_smooth_errors_agree(shape: tuple[int, int], tilt: float) -> None:
    y, x = np.mgrid[: shape[0], : shape[1]] * MM_PER_PX
    height = press(shape) + 0.02 * np.cos(x / 2.9) * np.cos(y / 2.3) + tilt * x
    gy, gx = (g.astype(np.float32) for g in np.gradient(height, MM_PER_PX))
    fast, plain = both_ways(
        lambda compiled: height_error(
            height.astype(np.float32), gx, gy, mm_per_px=MM_PER_PX, compiled=compiled
        )
    )
    assert fast == pytest.approx(plain, abs=AGREES * float(np.ptp(height)))
