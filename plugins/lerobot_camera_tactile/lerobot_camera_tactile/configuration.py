"""What a tactile camera is configured with, in Python or on LeRobot's command line."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

from lerobot.cameras.configs import CameraConfig


@CameraConfig.register_subclass("tactile")
@dataclass(kw_only=True)
class TactileCameraConfig(CameraConfig):
    """A tactile sensor as a camera, ``type: tactile``.

    Size and rate need not be given: they are those of the profile. A rate that is given limits how
    often the sensor measures.

    Attributes
    ----------
    profile : str
        Name of a profile, or path of its YAML file.
    serial, bundle, reference, script : str or None
        As of ``tactile_core.open_sensor``.
    sim : bool
        Open the virtual sensor.
    use_depth : bool
        Give heights: ``read_latest_depth``.
    python : str
        Interpreter that has tactile-core, which opens and measures the sensor in a process of its
        own. Default: this interpreter.
    warmup_s : float
        How long observations are left out after the sensor was opened, s.
    opening_s : float
        Longest time until the sensor has sent its first observation, s.
    """

    profile: str
    serial: str | None = None
    bundle: str | None = None
    reference: str | None = None
    script: str | None = None
    sim: bool = False
    use_depth: bool = False
    python: str = sys.executable
    warmup_s: float = 1.0
    opening_s: float = 60.0

    def sensor_options(self) -> dict[str, Any]:
        """Return the keyword arguments of ``tactile_core.open_sensor``."""
        names = "profile", "serial", "bundle", "reference", "script", "sim"
        return {name: getattr(self, name) for name in names}
