"""Contact circles of a ball of known radius, located to sub-pixel accuracy without user input.

The slope of a ball is an odd function of the offset from its centre, and to first order so is the
colour change. The most negative peak of its self-convolution starts the search (``symmetry``,
``start``). On the ball the normal is (p − c) / R exactly, so for known centres the colour change is
linear in the unknown light. Light and centres are fitted alternately over the given presses
(``light``, ``finder``). The contact ends where the slope departs from that of the ball
(``border``). The centres of a grid of balls are given and only refined (``grid``).
"""

from tactile_core.algorithms.circles.finder import (
    Circle,
    find_circles,
    fit_light,
    locate,
)
from tactile_core.algorithms.circles.grid import GridLight, refine_grid
from tactile_core.algorithms.circles.light import Light
from tactile_core.algorithms.circles.press import PressImage, working_scale
from tactile_core.algorithms.circles.start import Start

__all__ = [
    "Circle",
    "GridLight",
    "Light",
    "PressImage",
    "Start",
    "find_circles",
    "fit_light",
    "locate",
    "refine_grid",
    "working_scale",
]
