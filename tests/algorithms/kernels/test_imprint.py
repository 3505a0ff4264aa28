"""The kernels of imprint agree with numpy, which is the definition."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.kernel_agreement import AGREES, both_ways, needs_kernels, seeds

from tactile_core.algorithms.slip.imprint import Imprint, step_between
from tactile_core.algorithms.slip.surface_view import SurfaceView

pytestmark = needs_kernels


@given(seeds, st.floats(0, 3))
@settings(max_examples=6)
def test_imprints_agree(seed: int, moved_px: float) -> None:
    rng = np.random.default_rng(seed)
    markers = 24.0 * np.stack(np.meshgrid(np.arange(1, 12), np.arange(1, 9)), -1).reshape(-1, 2)
    noise = cv2.GaussianBlur(rng.normal(0, 1, (240, 640, 3)).astype(np.float32), (0, 0), 2)
    frames = [np.clip(120 + 100 * half, 60, 250).astype(np.uint8) for half in np.split(noise, 2, 1)]
    frames = [np.ascontiguousarray(frame) for frame in frames]
    for x, y in markers.astype(int).tolist():
        for frame in frames:
            cv2.circle(frame, (x, y), 4, (5, 5, 5), cv2.FILLED)
    px = markers + rng.normal(0, moved_px, markers.shape)

    def imprints(compiled: bool) -> list[Imprint]:
        view = SurfaceView(frames[0], markers, 8.0, compiled=compiled)
        return [Imprint(*view.imprint(pixels, px), compiled=compiled) for pixels in frames]

    fast, plain = both_ways(imprints)
    for one, other in zip(fast, plain, strict=True):
        np.testing.assert_array_equal(one.seen, other.seen)
        np.testing.assert_allclose(one.pattern, other.pattern, rtol=0, atol=AGREES)
        for name in ("energy", "count", "centre", "radius"):
            assert getattr(one, name) == pytest.approx(getattr(other, name), rel=AGREES)
    one, other = step_between(*fast), step_between(*plain)
    for name in ("changed", "unexplained", "energy", "values", "variance"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), rel=10 * AGREES)
    assert one.motion == pytest.approx(other.motion, abs=10 * AGREES)
