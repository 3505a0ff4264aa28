"""The kernels of light agree with numpy, which is the definition."""

from __future__ import annotations

import numpy as np
import pytest
from support.kernel_agreement import AGREES, both_ways, needs_kernels

from tactile_core.algorithms.drift import ReferenceLevels

pytestmark = needs_kernels


@pytest.mark.parametrize("shape", [(48, 64, 3), (97, 131, 6), (480, 640, 1)])
@pytest.mark.parametrize("marked", [True, False])
def test_light_changes_agree(shape: tuple[int, int, int], marked: bool) -> None:
    rng = np.random.default_rng(0)
    reference = rng.uniform(5, 240, shape).astype(np.float32)
    gains = rng.normal(1, 0.03, shape[2]) * rng.normal(1, 0.01, shape)
    pixels = np.rint(np.clip(reference * gains, 0, 255)).astype(np.uint8)
    hidden = rng.random(shape[:2]) < 0.1 if marked else None
    fast, plain = both_ways(
        lambda compiled: np.hstack(
            ReferenceLevels(reference, 255.0, compiled=compiled).change(pixels, hidden) or ()
        )
    )
    assert plain.size == shape[2] + 1
    assert fast == pytest.approx(plain, rel=AGREES, abs=AGREES)


def test_a_light_that_has_not_changed_agrees() -> None:
    even = np.full((48, 64, 3), 120, np.uint8)
    fast, plain = both_ways(
        lambda compiled: ReferenceLevels(even.astype(np.float32), 255.0, compiled=compiled).gains(
            even
        )
    )
    np.testing.assert_array_equal(fast, plain)
