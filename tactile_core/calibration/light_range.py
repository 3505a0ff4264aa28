"""The light of the undeformed gel and of all presses, its directions, and the shape of the gel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tactile_core.acquisition.devices import lights_of, make_lights
from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.force.elastic_layer import THICKNESS_MM
from tactile_core.algorithms.light.drift import LEVELS
from tactile_core.bundles.manifest import LightRange, Pairs
from tactile_core.calibration.presses import PRESS, FoundPress
from tactile_core.calibration.target_surface import TargetSurface
from tactile_core.conditioning.gel_check import GelCheck, ramp_size
from tactile_core.interfaces.calibration import Press
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Reference


def light_range(surfaces: Sequence[TargetSurface], reference: Reference) -> LightRange | None:
    """Measure it; None with fewer than three channels, where a tilt may cause any change."""
    response = _pairs(_response(surfaces, reference))
    if len(response) < 3:
        return None
    none = ((0.0, 0.0),) * (len(response) - 2)
    start = LightRange(response=response, drift=none, ramp=0.0, field=0.0, agreement=0.0)
    check = GelCheck(reference, start)
    frames = {id(surface.frame): surface.frame for surface in surfaces}.values()
    found = [change for frame in frames if (change := check.change_of(frame)) is not None]
    if not found:
        return None
    drift = _pairs(np.mean([one.slope for one in found], axis=0))
    check = GelCheck(reference, start.model_copy(update={"drift": drift}))
    return LightRange(
        response=response,
        drift=drift,
        ramp=max(ramp_size(check.beyond_drift(one.slope)) for one in found),
        field=max(one.field for one in found),
        agreement=min(one.cubic for one in found),
    )


def _response(surfaces: Sequence[TargetSurface], reference: Reference) -> Array:
    """Fit the change of the logarithm of each channel to the slopes, (K, 2)."""
    slopes, changes = [], []
    darkest = LEVELS.least_divisor_share * reference.full_scale
    for surface in surfaces:
        sample = surface.training()
        at = sample.rows, sample.columns
        seen, before = (
            np.maximum(image[at].astype(np.float64), darkest)
            for image in (surface.frame.pixels, reference.pixels)
        )
        change = np.log(seen / before)
        linear = np.abs(change).max(axis=1) < 0.4  # linear in the slope
        slopes.append(np.column_stack([sample.gradients, np.ones(len(change))])[linear])
        changes.append(change[linear])
    fit, *_ = np.linalg.lstsq(np.concatenate(slopes), np.concatenate(changes), rcond=None)
    return np.asarray(fit[:2].T)


def _pairs(values: Array) -> Pairs:
    return tuple((round(float(x), 6), round(float(y), 6)) for x, y in values)


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

    # [degrees] A light whose learned azimuth differs from the profile's by more is reported.
    # Source: by hand, no script derives it. See ADR 17.
    far = [(name, a) for name, a in pairs if off_deg(name, a) > 25.0]
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


def thickness_of(profile: Profile) -> float:
    """Return the thickness of the gel in mm, the usual one if the profile gives none."""
    return THICKNESS_MM if profile.gel.thickness_mm is None else profile.gel.thickness_mm


def dome_radius_px(profile: Profile) -> float | None:
    """Return the radius of an undeformed domed gel in px; None for a flat one."""
    radius_mm = profile.gel.radius_mm
    return None if radius_mm is None else radius_mm / profile.image.mm_per_px


def undeformed_press(presses: Sequence[FoundPress], reference: Reference) -> Press:
    """Sample undeformed pixels for a frame full of balls, in the usual ratio, of the reference."""
    count = int(PRESS.undeformed_share * sum(len(press.training().rows) for press in presses))
    return undeformed_sample(presses[0].frame, reference, count)


def undeformed_sample(frame: Frame, reference: Reference, count: int) -> Press:
    """Sample pixels all over the reference, with slope and height 0."""
    height, width = reference.pixels.shape[:2]
    rng = np.random.default_rng(0)
    return Press(
        frame=replace(frame, pixels=reference.pixels, marker_mask=reference.marker_mask),
        rows=rng.integers(0, height, count).astype(np.int32),
        columns=rng.integers(0, width, count).astype(np.int32),
        gradients=np.zeros((count, 2), np.float32),
        name="reference",
        heights_mm=np.zeros(count, np.float32),
    )
