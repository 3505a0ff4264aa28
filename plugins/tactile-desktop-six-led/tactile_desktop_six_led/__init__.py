"""The desktop rig (Johnson, Cole, Raj, Adelson 2011) for tactile-core."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_calibrators() -> Mapping[str, str]:
    """Return the calibrator for photometric stereo."""
    return {
        "photometric_stereo": "tactile_desktop_six_led.photometric_stereo:PhotometricCalibrator"
    }


@hookimpl
def tactile_artefacts() -> Mapping[str, str]:
    """Return the models: lights learned from presses, and lights given by a profile."""
    return {
        "photometric_stereo": "tactile_desktop_six_led.photometric_stereo:PhotometricStereo",
        "given_lights": "tactile_desktop_six_led.given_lights:GivenLights",
    }
