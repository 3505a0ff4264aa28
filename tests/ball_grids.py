"""How wrong measured normals are on the balls of a target."""

from __future__ import annotations

import numpy as np

from tactile_core.calibrating.presses import angles_deg
from tactile_core.formats.target import BallGrid
from tactile_core.quantities import Gradients

WITHIN = 0.8
"""Of a ball's radius: beyond, lamps fall into the ball's own shadow."""


def errors_deg(measured: Gradients, grid: BallGrid) -> np.ndarray:
    """(N,) angle between measured and true normals, over all pixels on a ball.

    Parameters
    ----------
    measured : Gradients
    grid : BallGrid
        Its centres in pixels of the measured image.
    """
    height, width = measured.x.shape
    radius_px = grid.radius_mm / measured.mm_per_px
    errors = []
    for x0, y0 in grid.centres_px:
        x, y = np.arange(width) - x0, np.arange(height)[:, None] - y0
        on = np.hypot(x, y) < WITHIN * radius_px
        offset = np.stack(np.broadcast_arrays(x, y), -1)[on]
        true = -offset / np.sqrt(radius_px**2 - (offset**2).sum(1))[:, None]
        errors.append(angles_deg(np.stack([measured.x[on], measured.y[on]], 1), true))
    return np.concatenate(errors)
