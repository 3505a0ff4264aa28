"""Where the skin leaves the ball: the radius of contact."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.light import Light
from tactile_core.algorithms.circles.press import Change
from tactile_core.algorithms.circles.symmetry import vertex

LARGEST = 0.98
_SMALLEST, _STEP = 0.25, 0.03
_DECAYS = (0.2, 0.3, 0.45, 0.7)
_STEEPEST = 0.999
_MOST_PIXELS = 1500


def contact_radius(change: Change, light: Light, centre: Float64, ball_radius: float) -> float:
    """Radius at which the slope stops being the ball's, in working pixels.

    Inside, the sine of the slope is r / R; outside, it decays exponentially. Border and decay are
    those whose colours fit best.
    """
    x, y = change.disc(centre, 1.5 * ball_radius)
    keep = np.random.default_rng(0).permutation(len(x))[:_MOST_PIXELS]
    xy = np.stack([x[keep], y[keep]], 1).astype(np.float64)
    if len(xy) < 30:
        return 0.0
    offset = xy - centre
    r = np.hypot(*offset.T)
    direction = offset / np.maximum(r, 1e-6)[:, None]
    colour, full = change.values[y[keep], x[keep]], change.full[y[keep], x[keep]]
    # In its direction the light of each pixel is a polynomial of the sine of the slope.
    powers = light.at(xy).along(direction)
    inside = r / ball_radius
    unit = max(light.residual, 1.0) ** 2

    def cost(border: float, decay: float) -> float:
        outside = border * np.exp(-np.maximum(inside - border, 0) / decay)
        sine = np.minimum(np.where(inside < border, inside, outside), _STEEPEST)[:, None]
        predicted = powers[-1] * sine
        for coefficients in powers[-2::-1]:
            predicted = (predicted + coefficients) * sine
        error = predicted - colour
        error[full & (error > 0)] = 0
        return float(np.mean(np.sqrt(1 + np.einsum("nk,nk->n", error, error) / unit)))

    borders = np.arange(_SMALLEST, LARGEST + 1e-9, _STEP)
    costs = np.array([min(cost(border, decay) for decay in _DECAYS) for border in borders])
    best = int(np.argmin(costs))
    border = borders[best]
    if 0 < best < len(borders) - 1:
        border += vertex(-costs[best - 1 : best + 2]) * _STEP
    return float(border * ball_radius)
