"""Options of the cameras of virtual sensors."""

from __future__ import annotations

from pydantic import Field

from tactile_core.interfaces.device import Options
from tactile_core.sim.modes import Mode


class UnitOptions(Options):
    """Which virtual unit is shown, and how finely it is simulated."""

    seed: int = Field(
        default=0, ge=0, description="Random seed of the virtual unit and of its noise."
    )
    mode: Mode = Field(
        default="fast",
        description="fast runs at camera rate; accurate solves the contact on a finer grid.",
    )
