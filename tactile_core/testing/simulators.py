"""Checks of simulators."""

from __future__ import annotations

import numpy as np

from tactile_core.interfaces.simulator import Simulator
from tactile_core.pipeline.playback import make_lights
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.differences import difference, report, report_errors
from tactile_core.testing.registered import Part
from tactile_core.testing.virtual_presses import generic_rig


class SimulatorChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.simulator.Simulator`."""

    @check("simulator")
    def test_rendering(self, part: Part) -> None:
        """A renderer takes frames of a profile's size and channels; a number gives one noise."""
        why = "virtual sensors would differ from their profiles, or give other results each time"
        do = "see the interface Renderer in tactile_core.interfaces.simulator"
        simulator: Simulator = self.registered.class_of(part)()
        rig = generic_rig()
        with report_errors(part, "it renders no frame", why=why, do=do):
            first, second = (
                simulator.renderer(rig.profile, seed=1).take_frame(np.zeros(rig.shape), number=2)
                for _ in range(2)
            )
        channels = tuple(make_lights(rig.profile).channels)
        shape = (*rig.shape, len(channels))
        found = difference(first.pixels, second.pixels, "pixels")
        found = found and f"the same seed and number give other frames: {found}"
        if first.pixels.shape != shape:
            found = f"a frame has the shape {first.pixels.shape}, not {shape}"
        elif first.channels != channels:
            found = f"a frame has the channels {first.channels}, not {channels}"
        report(part, found, why=why, do=do)
