"""Circles where a ball of known radius touches the gel, to sub-pixel, without a click.

A ball's slope is odd about its centre, so to first order the colour change is too: the most
negative peak of its self-convolution starts the search (``symmetry``, ``start``). On the ball the
normal is (p − c) / R exactly, so the change is linear in an unknown light once the centres are
known: light and centres are fitted in turn, over the presses given (``light``, ``finder``). The
contact's border is where the slope leaves the ball (``border``). A grid of balls comes with
centres, which are only refined (``grid``).
"""

from tactile_core.algorithms.circles.finder import (
    Circle,
    find_circles,
    fit_light,
    locate,
)
from tactile_core.algorithms.circles.grid import GridLight, refine_grid
from tactile_core.algorithms.circles.light import Light
from tactile_core.algorithms.circles.press import PressImage
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
]
