"""Directions of the lights: estimated from presses, and compared with those of the profile."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactile_core.acquisition.assembly import lights_of
from tactile_core.calibration.target_surface import TargetSurface
from tactile_core.pipeline.playback import make_lights
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Reference


class AZIMUTHS:
    """Parameters of the check of light directions.

    Nothing sets them from outside: it only warns.
    """

    # [degrees] A light whose learned azimuth differs from the profile's by more is reported.
    # Source: by hand, no script derives it. See ADR 17.
    tolerance_deg = 25.0


def channel_azimuths(presses: Sequence[TargetSurface], reference: Reference) -> tuple[float, ...]:
    """Estimate the azimuth of each channel's light, in degrees from x towards y.

    To first order, a channel brightens where the surface normal turns towards its light. A surface
    of slope g has the normal (−g, 1).

    References
    ----------
    .. [1] R. J. Woodham, "Photometric method for determining surface orientation from multiple
       images", Optical Engineering 19(1), 1980.
    """
    slopes, changes = zip(*(press.lighting(reference) for press in presses), strict=True)
    response, *_ = np.linalg.lstsq(np.concatenate(slopes), np.concatenate(changes), rcond=None)
    azimuths = np.degrees(np.arctan2(-response[1], -response[0]))
    return tuple(round(float(a), 1) for a in azimuths)


def misplaced_lights(
    profile: Profile, channels: Sequence[str], learned_deg: Sequence[float]
) -> tuple[str, ...]:
    """Return warnings of lights whose learned direction differs from the profile's."""
    expected = {light.name: light.azimuth_deg for light in lights_of(make_lights(profile))}
    pairs = [(c, a) for c, a in zip(channels, learned_deg, strict=True) if c in expected]

    def off_deg(name: str, azimuth_deg: float) -> float:
        return abs((azimuth_deg - expected[name] + 180) % 360 - 180)

    far = [(name, a) for name, a in pairs if off_deg(name, a) > AZIMUTHS.tolerance_deg]
    if not far:
        return ()
    nearest = []
    for _, azimuth in pairs:
        nearest.append(min((off_deg(name, azimuth), name) for name in expected)[1])
    where = ", ".join(f"{name} from {a:.0f}° (profile {expected[name]:.0f}°)" for name, a in far)
    if len(set(nearest)) == len(nearest) and nearest != [name for name, _ in pairs]:
        return (
            f"light directions differ from the profile: {where}; they match in the order "
            f"{', '.join(nearest)}, so correct the profile or the order of the images",
        )
    return (f"light directions differ from the profile: {where}; correct 'azimuth_deg'",)
