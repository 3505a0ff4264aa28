"""Checks of simulators."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tactile_core.acquisition.devices import make_lights
from tactile_core.interfaces.simulator import Simulator
from tactile_core.pipeline.playback import read_reference
from tactile_core.recordings.recording import open_recording
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

    @check("simulator")
    def test_written_presses(self, part: Part) -> None:
        """The presses and the reference that it writes can be read, and the ball has a size."""
        why = "a virtual sensor could not be calibrated"
        do = "write the recordings 'presses' and 'reference', and return the diameter in mm"
        simulator: Simulator = self.registered.class_of(part)()
        profile = generic_rig().profile
        with (
            TemporaryDirectory(prefix="tactile-conformance-") as name,
            report_errors(part, "its presses cannot be read", why=why, do=do),
        ):
            ball_mm = simulator.write_presses(profile, Path(name), count=2)
            open_recording(Path(name, "presses"))
            read_reference(profile, Path(name, "reference"))
        found = "" if ball_mm > 0 else f"its ball has a diameter of {ball_mm} mm"
        report(part, found, why=why, do=do)
