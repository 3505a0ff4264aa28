"""What is normal for the light of a unit, from the frames that it is calibrated with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.levels import LEVELS
from tactile_core.bundles.light_range import LightRange, Pairs
from tactile_core.calibration.target_surface import TargetSurface
from tactile_core.conditioning.gel_check import GelCheck, ramp_size
from tactile_core.quantities import Reference

FIRST_ORDER = 0.4  # Largest logarithm of a change of intensity that counts as linear in the slope


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
        linear = np.abs(change).max(axis=1) < FIRST_ORDER
        slopes.append(np.column_stack([sample.gradients, np.ones(len(change))])[linear])
        changes.append(change[linear])
    fit, *_ = np.linalg.lstsq(np.concatenate(slopes), np.concatenate(changes), rcond=None)
    return np.asarray(fit[:2].T)


def _pairs(values: Array) -> Pairs:
    return tuple((round(float(x), 6), round(float(y), 6)) for x, y in values)
