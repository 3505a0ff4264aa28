"""What the plugin ``sim`` registers."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_cameras() -> Mapping[str, str]:
    """Return the cameras of virtual sensors."""
    return {
        "virtual": "tactile_sim.camera:VirtualCamera",
        "hand": "tactile_sim.camera:VirtualHandCamera",
    }


@hookimpl
def tactile_simulators() -> Mapping[str, str]:
    """Return the simulator of any profile."""
    return {"virtual": "tactile_sim.simulation:VirtualUnits"}


@hookimpl
def tactile_commands() -> Mapping[str, str]:
    """Return the commands that need a virtual sensor."""
    return {
        "demo": "tactile_sim.commands:demo",
        "simulate": "tactile_sim.commands:simulate",
        "starting-calibration": "tactile_sim.commands:starting_calibration",
        "bench": "tactile_sim.commands:bench",
    }
