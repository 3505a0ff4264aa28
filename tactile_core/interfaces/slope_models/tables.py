"""A table over colour that is as good as its model: a faster way over large images."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tactile_core.algorithms.colour_table import Axis, ColourTable, bake
from tactile_core.algorithms.normal_xy import to_normal_xy
from tactile_core.algorithms.slope_field import Model, takes_table
from tactile_core.interfaces.calibrator import Press
from tactile_core.interfaces.slope_models.fields import sampler_of, slope_field
from tactile_core.interfaces.slope_models.image_shape import shape_of
from tactile_core.quantities import Float32, Reference

POINTS = (1_200, 4_800, 19_200)
"""Points of the coarse grid that are tried, one after another."""

FAITHFUL_SINE = 0.0175
"""Largest mean distance of table and model, 1°: half of what the best models err."""

_PRESSES_COMPARED = 4


def baked(
    model: Model,
    features: Float32,
    presses: Sequence[Press],
    reference: Reference,
    blur_px: float,
) -> ColourTable | None:
    """Table of a model for the colours that were seen; None where none is needed."""
    height, width, channels = shape_of(reference)
    if not takes_table((height, width, channels)):
        return None
    table = bake(model, Axis.spanning(features[:, :3]), aspect=height / width)
    return faithful(table, model, presses, reference, blur_px)


def faithful(
    table: ColourTable,
    model: Model,
    presses: Sequence[Press],
    reference: Reference,
    blur_px: float,
) -> ColourTable | None:
    """The table with as many points as keep it near its model on some presses; None if none do.

    How fast the light varies over the gel, and how large the presses are, decides.
    """
    sampler = sampler_of(reference, blur_px)
    some = presses[:: max(1, len(presses) // _PRESSES_COMPARED)][:_PRESSES_COMPARED]
    for points in POINTS:
        candidate = replace(table, points=points)
        field = slope_field(model, candidate, reference, blur_px)
        apart = []
        for press in some:
            at = press.rows, press.columns
            gx, gy, _ = field.measure(press.frame.pixels, press.frame.marker_mask)
            exact = model(sampler.features(press.frame.pixels, press.frame.marker_mask, *at))
            fast = to_normal_xy(np.stack([gx[at], gy[at]], axis=1))
            apart.append(np.linalg.norm(fast - exact, axis=1))
        if np.concatenate(apart).mean() < FAITHFUL_SINE:
            return candidate
    return None
