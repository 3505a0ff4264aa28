"""The kernels of slopes agree with numpy, which is the definition."""

from __future__ import annotations

import numpy as np
import pytest
from support.kernel_agreement import AGREES, both_ways, needs_kernels

from tactile_core.algorithms.colour_table import Axis, ColourTable
from tactile_core.algorithms.slope_field import SlopeField

pytestmark = needs_kernels


@pytest.mark.parametrize("per_unit", [40.0, 80.0, 113.7])
def test_every_pair_of_bytes_finds_the_same_entry(per_unit: float) -> None:
    levels = np.arange(256, dtype=np.uint8)
    pixels = np.stack([np.tile(levels, (246, 1))] * 3, axis=2)
    reference = np.stack([np.tile(np.arange(10, 256)[:, None], (1, 256))] * 3, axis=2)
    normal_xy = np.random.default_rng(0).uniform(-0.6, 0.6, (2, 80, 80, 80)).astype(np.float32)
    table = ColourTable(Axis(per_unit, first=25, count=80), normal_xy[0] + 1j * normal_xy[1])

    def slopes(compiled: bool) -> np.ndarray:
        nothing = SlopeField(
            lambda features: np.zeros((len(features), 2), np.float32),
            table,
            reference.astype(np.float32),
            blur_px=0,
            compiled=compiled,
        )
        return np.stack(nothing.measure(pixels)[:2])

    fast, plain = both_ways(slopes)
    assert fast == pytest.approx(plain, rel=AGREES, abs=AGREES)


@pytest.mark.parametrize("shape", [(240, 320), (241, 318)])
@pytest.mark.parametrize("gain", [0.5, 4.0], ids=["gentle", "too steep"])
@pytest.mark.parametrize("pitch", [17, 1000], ids=["markers", "no markers"])
def test_slopes_agree(shape: tuple[int, int], gain: float, pitch: int) -> None:
    rng = np.random.default_rng(0)
    reference = rng.uniform(90, 140, (*shape, 3)).astype(np.float32)
    y, x = np.mgrid[: shape[0], : shape[1]]
    waves = np.stack([np.sin(x / 30 + k) * np.cos(y / 40 - k) for k in range(3)], axis=2)
    pixels = np.rint(reference * (1 + 0.3 * waves)).astype(np.uint8)
    axis = Axis(per_unit=80, first=45, count=80)
    values = axis.values()
    normal_xy = gain * (values[:, None, None] + 1j * values[None, :, None] + 0 * values)
    table = ColourTable(axis, np.asarray(normal_xy, np.complex64))

    hidden = np.hypot(x % pitch - 8, y % pitch - 8) < 4

    def model(features: np.ndarray) -> np.ndarray:
        return np.asarray(gain * features[:, :2] * (1 + 0.2 * features[:, 3:4]), np.float32)

    fast, plain = both_ways(
        lambda compiled: np.stack(
            SlopeField(model, table, reference, hidden, compiled=compiled).measure(pixels, hidden)[
                :2
            ]
        )
    )
    assert fast == pytest.approx(plain, rel=AGREES, abs=AGREES)
