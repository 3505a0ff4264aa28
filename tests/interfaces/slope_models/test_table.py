"""A table stands for a model only where it gives its slopes."""

from __future__ import annotations

import numpy as np

from tactile_core.interfaces.calibration import Press
from tactile_core.interfaces.slope_models.samples import baked
from tactile_core.quantities import Float32, Frame, Reference

SHAPE = (180, 240, 3)
CHANNELS = ("red", "green", "blue")


def light(features: Float32, waves: float) -> Float32:
    """Normals whose dependence on the colour varies over the gel in so many waves."""
    turned = features[:, :2] * (1 + 0.8 * np.sin(2 * np.pi * waves * features[:, 3:]))
    return np.asarray(turned, np.float32)


def table_of(waves: float) -> object:
    rng = np.random.default_rng(0)
    pixels = (100 + rng.uniform(-30, 30, 3) * np.ones(SHAPE)).astype(np.float32)
    reference = Reference(np.full(SHAPE, 100, np.float32), CHANNELS)
    rows, columns = (rng.integers(0, n, 3000).astype(np.int32) for n in SHAPE[:2])
    press = Press(Frame(pixels, CHANNELS, 0.05), rows, columns, np.zeros((3000, 2), np.float32))
    features = rng.uniform(-0.3, 0.3, (3000, 5)).astype(np.float32)
    return baked(lambda each: light(each, waves), features, [press], reference, 2.0)


def test_a_table_follows_light_that_varies_slowly() -> None:
    assert table_of(0.3) is not None


def test_light_that_varies_faster_than_its_points_takes_the_model_itself() -> None:
    assert table_of(20.0) is None
