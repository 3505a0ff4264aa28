"""Virtual sensors: frames of any profile without hardware, with ground truth.

May import calibration, pipeline and what these may import.

``VirtualStage`` moves an object on the gel surface of any profile. ``Faults`` describes defects of
the rig. Both are imported on first use.
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
