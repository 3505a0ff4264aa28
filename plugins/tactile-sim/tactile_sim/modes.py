"""Simulation modes: resolution and tolerances of "fast" and "accurate"."""

from __future__ import annotations

from typing import Literal, NamedTuple

from tactile_sim.contact_step import Precision

Mode = Literal["accurate", "fast"]


class ModeParameters(NamedTuple):
    """Resolution and tolerances of one simulation mode. The user selects the mode instead.

    Attributes
    ----------
    nodes_across : int, count
        Nodes along the longer side of the gel; in the accurate mode, before refinement.
        Source: chosen by hand for the fast mode to run at camera rate (``benchmarks/bench_sim.py``
        measures it).
    precision : Precision
        Solver tolerances (relative) and sweeps (count).
        Source: chosen by hand; ``tests/test_gel_surface.py`` compares both modes.
    press_steps : int, count
        Default number of increments of a press.
        Source: chosen by hand; no script derives it.
    """

    nodes_across: int
    precision: Precision
    press_steps: int


# The values in use.
MODES: dict[Mode, ModeParameters] = {
    "fast": ModeParameters(
        nodes_across=128,
        precision=Precision(normal=2e-3, friction=5e-3, sweeps=1),
        press_steps=4,
    ),
    "accurate": ModeParameters(
        nodes_across=256,
        precision=Precision(normal=1e-4, friction=1e-3, sweeps=3),
        press_steps=5,
    ),
}
