"""Cross-validation: every score comes from presses that neither model nor light has seen."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np

from tactile_core.algorithms.arrays.gradient import gradient
from tactile_core.algorithms.poisson import integrate
from tactile_core.calibration.error_fit import HeldOutSurface, fitted_errors
from tactile_core.calibration.held_out import Fold
from tactile_core.calibration.presses import angles_deg
from tactile_core.calibration.target_surface import S
from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.calibrator import Press
from tactile_core.interfaces.progress import Progress, Silent
from tactile_core.interfaces.slope_errors import SlopeErrors
from tactile_core.plugins.returned import measured_by
from tactile_core.quantities import Float32, Gradients, HeightMap, Reference


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


@dataclass(frozen=True, eq=False)
class Score:
    """Held-out errors of a calibration.

    Attributes
    ----------
    presses : int
        Number of scored presses.
    mean_deg, median_deg, p90_deg : float
        Angle between measured and true normals, in degrees, over pixels within 0.8 of the contact
        radius, or over all of a height map.
    predict_flat_deg : float
        Baseline: the mean error of a prediction of level gel everywhere.
    height_rmse_mm : float
        Root-mean-square error of the height over the same pixels, integrated from slopes or as
        measured. What slopes leave undetermined is removed: a constant, and for a height map its
        tilt.
    samples : (N, 4) float32
        Measured and true slopes of a sample of pixels, for the report.
    errors : SlopeErrors or None
        Size of the errors against the measured slope; None if heights are measured directly.
    """

    presses: int
    mean_deg: float
    median_deg: float
    p90_deg: float
    predict_flat_deg: float
    height_rmse_mm: float
    samples: np.ndarray
    errors: SlopeErrors | None = None

    def summary(self) -> dict[str, Any]:
        """Return the ``held_out`` entry of ``tactile calibrate --json``."""
        return {
            "presses": self.presses,
            "normal_error_deg": {
                "mean": round(self.mean_deg, 4),
                "median": round(self.median_deg, 4),
                "p90": round(self.p90_deg, 4),
            },
            "predict_flat_deg": round(self.predict_flat_deg, 4),
            "height_rmse_mm": round(self.height_rmse_mm, 6),
        }


@dataclass(frozen=True, eq=False)
class _Measured:
    """Slopes and heights of a frame, (H, W) each: one measured, the other derived from it."""

    gx: Float32
    gy: Float32
    height_mm: Float32
    integrated: bool = True

    @classmethod
    def of(cls, measured: Gradients | HeightMap) -> Self:
        """Integrate slopes, or differentiate heights."""
        scale = measured.mm_per_px
        if isinstance(measured, HeightMap):
            return cls(*gradient(measured.mm, scale), measured.mm, integrated=False)
        gx, gy = measured.x, measured.y
        return cls(gx, gy, integrate(gx, gy, mm_per_px=scale))


def cross_validate(
    surfaces: Sequence[S],
    without: Callable[[Collection[int]], Fold[S] | None],
    undeformed: Reference,
    fit: Callable[[Sequence[Press], Reference], Calibration],
    *,
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
    for fold in range(folds):
        progress.fraction(fold / folds)
        held_out = range(fold, len(surfaces), folds)
        to_score = [i for i in held_out if surfaces[i].used]
        training = without(held_out) if to_score else None
        if training is None:
            continue
        model = fit(training.samples, training.reference)
        by_frame: dict[int, _Measured] = {}
        for surface in map(training.find, to_score):
            key = id(surface.frame)
            if key not in by_frame:
                by_frame[key] = _Measured.of(measured_by(model, surface.frame, undeformed))
            measured = by_frame[key]
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
                held_out_surfaces.append(HeldOutSurface(*shape, surface.training()))
    progress.fraction(1.0)
    if not errors or not sum(map(len, errors)):
        return None
    all_errors = np.concatenate(errors)
    return Score(
        presses=len(errors),
        mean_deg=float(all_errors.mean()),
        median_deg=float(np.median(all_errors)),
        p90_deg=float(np.percentile(all_errors, 90)),
        predict_flat_deg=float(np.concatenate(flat).mean()),
        height_rmse_mm=float(np.sqrt(np.mean(np.concatenate(height_errors) ** 2))),
        samples=np.concatenate(slopes).astype(np.float32),
        errors=fitted_errors(held_out_surfaces),
    )
