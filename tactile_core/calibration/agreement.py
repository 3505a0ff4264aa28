"""Agreement of calibrations that were fitted on disjoint sets of surfaces."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

import numpy as np

from tactile_core.calibration.held_out import Fold
from tactile_core.calibration.measured import measured_frames
from tactile_core.calibration.presses import angles_deg
from tactile_core.calibration.target_surface import S
from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.calibrator import Press
from tactile_core.quantities import Reference

Fit = Callable[[Sequence[Press], Reference], Calibration]
"""Fits a calibration to training samples and a reference."""

Without = Callable[[Collection[int]], Fold[S] | None]
"""Maps indices of held-out surfaces to a fold of the others."""


def halves_difference_deg(
    surfaces: Sequence[S], without: Without[S], undeformed: Reference, fit: Fit
) -> float | None:
    """Compare the calibrations on every second used surface with that on the others.

    Each half finds its circles and its light on its own, so that the difference contains their
    errors as far as they vary from press to press.

    Returns
    -------
    float or None
        Mean angle between the normals of both, in degrees, over the scored pixels of all used
        surfaces; None with fewer than two surfaces in a half.
    """
    used = [i for i, surface in enumerate(surfaces) if surface.used]
    if len(used) < 4:
        return None
    measured = []
    for half in (used[::2], used[1::2]):
        training = without([i for i in range(len(surfaces)) if i not in half])
        if training is None:
            return None
        model = fit(training.samples, training.reference)
        frames = measured_frames(model, (surfaces[i] for i in used), undeformed)
        measured.append(
            np.concatenate([_slopes(surface, shown.gx, shown.gy) for surface, shown in frames])
        )
    return float(angles_deg(*measured).mean())


def left_out_size_ratio(
    surfaces: Sequence[S], without: Without[S], undeformed: Reference, fit: Fit
) -> float | None:
    """Measure balls of each size with a calibration on the other sizes.

    Returns
    -------
    float or None
        Median radius of the fitted spheres over that of the balls, of the size where it is
        farthest from 1; None without two sizes of usable balls.
    """
    sizes = {surface.ball_diameter_mm for surface in surfaces if surface.used}
    if len(sizes) < 2:
        return None
    medians = []
    for size in sorted(size for size in sizes if size is not None):
        held_out = [i for i, surface in enumerate(surfaces) if surface.ball_diameter_mm == size]
        training = without(held_out)
        if training is None:
            return None
        model = fit(training.samples, training.reference)
        balls = map(training.find, (i for i in held_out if surfaces[i].used))
        spheres = [
            ball.sphere(shown.height_mm)
            for ball, shown in measured_frames(model, balls, undeformed)
        ]
        ratios = [sphere.radius_ratio for sphere in spheres if sphere is not None]
        if ratios:
            medians.append(float(np.median(ratios)))
    return max(medians, key=lambda ratio: abs(ratio - 1)) if medians else None


def _slopes(surface: S, gx: np.ndarray, gy: np.ndarray) -> np.ndarray:
    mask = surface.scored()
    return np.stack([gx[mask], gy[mask]], 1)
