"""The desktop rig (Johnson, Cole, Raj, Adelson 2011) for tactile-core."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_calibrations() -> Mapping[str, str]:
    """Photometric stereo."""
    return {"photometric_stereo": "tactile_desktop_six_led.photometric_stereo:PhotometricStereo"}
