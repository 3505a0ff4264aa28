"""A lookup table that approximates a slope model, for faster measurement of large images."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tactile_core.algorithms.colour_table import Axis, ColourTable, bake
from tactile_core.algorithms.normal_xy import to_normal_xy
from tactile_core.algorithms.slope_field import takes_table
from tactile_core.algorithms.slope_grid import Model
from tactile_core.interfaces.calibrator import Press
from tactile_core.interfaces.slope_models.fields import sampler_of, slope_field
from tactile_core.interfaces.slope_models.image_shape import shape_of
from tactile_core.quantities import Float32, Reference


class TABLE:
    """Parameters of choosing a table.

    Nothing sets them: the choice is checked against the model.
    """

    # [count] Numbers of points of the coarse grid over the image that are tried, in this order.
    # Source: by hand, each grid is twice as fine as the one before.
    points: tuple[int, ...] = (1_200, 4_800, 19_200)
    # [sine of the angle] Largest mean distance between table and model. Source: the sine of 1°,
    # half the error of the best models (``docs/reference/accuracy.md``).
    largest_error = 0.0175
    presses_compared = 4  # [count] Presses on which table and model are compared


def baked(
    model: Model,
    features: Float32,
    presses: Sequence[Press],
    reference: Reference,
    blur_px: float,
) -> ColourTable | None:
    """Return a table of a model over the colours of the training pixels; None if not needed."""
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
    """Return the table on the coarsest grid that reproduces its model on some presses.

    The necessary number of points depends on how fast the light varies over the gel.

    Returns
    -------
    ColourTable, or None if no grid is fine enough
    """
    sampler = sampler_of(reference, blur_px)
    step = max(1, len(presses) // TABLE.presses_compared)
    some = presses[::step][: TABLE.presses_compared]
    for points in TABLE.points:
        candidate = replace(table, points=points)
        field = slope_field(model, candidate, reference, blur_px)
        distances = []
        for press in some:
            at = press.rows, press.columns
            cells = field.measure(press.frame.pixels, press.frame.marker_mask)
            gx, gy = cells.image(press.frame.pixels.shape[:2])
            exact = model(sampler.features(press.frame.pixels, press.frame.marker_mask, *at))
            fast = to_normal_xy(np.stack([gx[at], gy[at]], axis=1))
            distances.append(np.linalg.norm(fast - exact, axis=1))
        if np.concatenate(distances).mean() < TABLE.largest_error:
            return candidate
    return None
