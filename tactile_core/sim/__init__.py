"""Virtual sensors: frames of any profile without hardware, with the truth beside them.

May import calibration, pipeline and what these may import.

``VirtualStage`` moves an object on the skin of any profile; ``Faults`` are what may go wrong with
the rig. Both are imported when they are first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tactile_core.sim.optics.faults import Faults as Faults
    from tactile_core.sim.stage import VirtualStage as VirtualStage

__all__ = ["Faults", "VirtualStage"]


def __getattr__(name: str) -> Any:
    if name == "VirtualStage":
        from tactile_core.sim.stage import VirtualStage

        return VirtualStage
    if name == "Faults":
        from tactile_core.sim.optics.faults import Faults

        return Faults
    raise AttributeError(f"module 'tactile_core.sim' has no attribute {name!r}")
