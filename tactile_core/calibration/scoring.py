"""Cross-validation: every score comes from presses that neither model nor light has seen."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import NamedTuple

import numpy as np

from tactile_core.calibration.agreement import halves_difference_deg, left_out_size_ratio
from tactile_core.calibration.error_fit import HeldOutSurface, fitted_errors
from tactile_core.calibration.held_out import Fold
from tactile_core.calibration.measured import measured_frames
from tactile_core.calibration.presses import angles_deg
from tactile_core.calibration.score import Score
from tactile_core.calibration.target_surface import MeasuredSphere, S
from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.calibrator import Press
from tactile_core.interfaces.progress import Progress, Silent
from tactile_core.quantities import Reference


class ScoringParameters(NamedTuple):
    """Parameters of the cross-validation. Nothing sets them, so that scores stay comparable.

    Attributes
    ----------
    folds : int, count
        Folds of the cross-validation, at most.
        Source: chosen by hand; the usual number of folds.
    report_samples : int, count
        Pixels of each surface that the report plots.
        Source: chosen by hand; no script derives it.
    """

    folds: int = 5
    report_samples: int = 200


SCORING = ScoringParameters()
"""The values in use."""


def cross_validate(
    surfaces: Sequence[S],
    without: Callable[[Collection[int]], Fold[S] | None],
    undeformed: Reference,
    fit: Callable[[Sequence[Press], Reference], Calibration],
    *,
    thickness_mm: float,
    progress: Progress | None = None,
) -> Score | None:
    """Score a calibrator by k-fold cross-validation over surfaces.

    The surfaces to score are selected once: those that are used. Circles, light model and
    calibration of a fold are estimated without the surfaces that it holds out.

    Parameters
    ----------
    surfaces : sequence of TargetSurface
        All that were found, unusable ones included.
    without : callable
        Maps indices of held-out surfaces to a :class:`Fold` of the others; None if none of the
        others can be used.
    undeformed : Reference
        Held-out surfaces are measured against it.
    fit : callable
        Fits a calibration to training samples and a reference.
    thickness_mm : float
        Thickness of the gel.
    progress : Progress, optional

    Returns
    -------
    Score, or None with fewer than two usable surfaces

    References
    ----------
    .. [1] M. Stone, "Cross-Validatory Choice and Assessment of Statistical Predictions", Journal of
       the Royal Statistical Society B 36(2), 1974.
    """
    if sum(surface.used for surface in surfaces) < 2:
        return None
    progress = progress or Silent()
    folds = min(SCORING.folds, len(surfaces))
    errors, flat, slopes, height_errors = [], [], [], []
    held_out_surfaces = list[HeldOutSurface]()
    spheres: dict[int, MeasuredSphere] = {}
    for fold in range(folds):
        progress.fraction(0.7 * fold / folds)
        held_out = range(fold, len(surfaces), folds)
        to_score = [i for i in held_out if surfaces[i].used]
        training = without(held_out) if to_score else None
        if training is None:
            continue
        model = fit(training.samples, training.reference)
        found_again = measured_frames(model, map(training.find, to_score), undeformed)
        for i, (surface, measured) in zip(to_score, found_again, strict=True):
            mask = surface.scored()
            rows, columns, true = surface.true_gradients(mask)
            found = np.stack([measured.gx[rows, columns], measured.gy[rows, columns]], 1)
            errors.append(angles_deg(found, true))
            flat.append(angles_deg(np.zeros_like(true), true))
            step = max(1, len(true) // SCORING.report_samples)
            slopes.append(np.column_stack([found, true])[::step])
            height_errors.append(surface.height_errors_mm(measured.height_mm, mask))
            if measured.integrated:
                shape = measured.gx, measured.gy, measured.height_mm
                held_out_surfaces.append(HeldOutSurface(*shape, surface.training(), thickness_mm))
            sphere = surface.sphere(measured.height_mm)
            if sphere is not None:
                spheres[i] = sphere
    if not errors or not sum(map(len, errors)):
        return None
    all_errors = np.concatenate(errors)
    halves = halves_difference_deg(surfaces, without, undeformed, fit)
    progress.fraction(0.9)
    left_out = left_out_size_ratio(surfaces, without, undeformed, fit)
    progress.fraction(1.0)
    return Score(
        presses=len(errors),
        mean_deg=float(all_errors.mean()),
        median_deg=float(np.median(all_errors)),
        p90_deg=float(np.percentile(all_errors, 90)),
        predict_flat_deg=float(np.concatenate(flat).mean()),
        height_rmse_mm=float(np.sqrt(np.mean(np.concatenate(height_errors) ** 2))),
        samples=np.concatenate(slopes).astype(np.float32),
        errors=fitted_errors(held_out_surfaces),
        spheres=spheres,
        halves_difference_deg=halves,
        left_out_size_ratio=left_out,
    )
