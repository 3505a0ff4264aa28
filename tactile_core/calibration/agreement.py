"""Agreement of calibrations that were fitted on disjoint sets of surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tactile_core.calibration.measured import measured_frames
from tactile_core.calibration.presses import angles_deg
from tactile_core.calibration.target_surface import S
from tactile_core.calibration.trials import Trials


def halves_of(used: Sequence[int]) -> list[tuple[int, ...]]:
    """Every second surface and the others; none with fewer than two in a half."""
    return [tuple(used[::2]), tuple(used[1::2])] if len(used) >= 4 else []


def slopes_by_half(trials: Trials[S], half: Sequence[int]) -> np.ndarray | None:
    """Slopes (N, 2) of the scored pixels of all used surfaces, by a calibration on some.

    A half finds its circles and its light on its own, so that the difference between two contains
    their errors as far as they vary from press to press. None if the half cannot be used.
    """
    surfaces = trials.surfaces
    training = trials.without([i for i in range(len(surfaces)) if i not in half])
    if training is None:
        return None
    model = trials.fit(training.samples, training.reference)
    frames = measured_frames(model, (surfaces[i] for i in trials.used), trials.reference)
    return np.concatenate([_slopes(surface, shown.gx, shown.gy) for surface, shown in frames])


def halves_difference_deg(slopes: Sequence[np.ndarray | None]) -> float | None:
    """Mean angle between the normals of two calibrations, in degrees; None without two."""
    measured = [one for one in slopes if one is not None]
    return float(angles_deg(*measured).mean()) if len(measured) == 2 else None


def sizes_of(trials: Trials[Any]) -> list[float]:
    """Diameters of the usable balls, mm; none if they have a single size."""
    sizes = {trials.surfaces[i].ball_diameter_mm for i in trials.used}
    return sorted(size for size in sizes if size is not None) if len(sizes) > 1 else []


def ratios_of_left_out_size(trials: Trials[S], diameter_mm: float) -> list[float] | None:
    """Measure balls of a size with a calibration on the other sizes.

    Returns
    -------
    list of float, or None
        Radii of the fitted spheres over that of the balls; None if the others cannot be used.
    """
    surfaces = trials.surfaces
    held_out = [i for i, s in enumerate(surfaces) if s.ball_diameter_mm == diameter_mm]
    training = trials.without(held_out)
    if training is None:
        return None
    model = trials.fit(training.samples, training.reference)
    balls = map(training.find, (i for i in held_out if surfaces[i].used))
    spheres = [
        ball.sphere(shown.height_mm)
        for ball, shown in measured_frames(model, balls, trials.reference)
    ]
    return [sphere.radius_ratio for sphere in spheres if sphere is not None]


def left_out_size_ratio(ratios: Sequence[Sequence[float] | None]) -> float | None:
    """Median ratio of the size where it is farthest from 1; None without any."""
    medians = [float(np.median(some)) for some in ratios if some]
    if any(some is None for some in ratios) or not medians:
        return None
    return max(medians, key=lambda ratio: abs(ratio - 1))


def _slopes(surface: S, gx: np.ndarray, gy: np.ndarray) -> np.ndarray:
    mask = surface.scored()
    return np.stack([gx[mask], gy[mask]], 1)
