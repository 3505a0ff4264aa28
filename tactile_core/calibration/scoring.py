"""Honest scores: every number comes from presses that neither model nor light has seen."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from tactile_core.algorithms.arrays.gradient import gradient
from tactile_core.algorithms.poisson import integrate
from tactile_core.calibration.held_out import Fold
from tactile_core.calibration.known_surface import S
from tactile_core.calibration.presses import angles_deg
from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.calibrator import Press
from tactile_core.interfaces.progress import Progress, Silent
from tactile_core.plugins.returned import measured_by
from tactile_core.quantities import Float32, Gradients, HeightMap, Reference

FOLDS = 5


@dataclass(frozen=True, eq=False)
class Score:
    """Held-out errors of a calibration.

    Attributes
    ----------
    presses : int
        How many were scored.
    mean_deg, median_deg, p90_deg : float
        Angle between measured and true normals, over pixels within 0.8 of the contact radius, or
        over all of a height map.
    predict_flat_deg : float
        The mean error of saying "flat" everywhere: what the others are to be compared with.
    height_rmse_mm : float
        Of the height, integrated or as it was measured, against the true one, over the same pixels,
        up to what no slope tells: a constant, and a height map's tilt.
    samples : (N, 4) float32
        Measured and true slope of a sample of pixels, for the report.
    """

    presses: int
    mean_deg: float
    median_deg: float
    p90_deg: float
    predict_flat_deg: float
    height_rmse_mm: float
    samples: np.ndarray

    def summary(self) -> dict[str, Any]:
        """The ``held_out`` entry of ``tactile calibrate --json``."""
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
    """Slopes and heights of a frame, (H, W) each: one was measured, the other follows from it."""

    gx: Float32
    gy: Float32
    height_mm: Float32

    @classmethod
    def of(cls, measured: Gradients | HeightMap) -> Self:
        """Integrate slopes, or differentiate heights."""
        scale = measured.mm_per_px
        if isinstance(measured, HeightMap):
            return cls(*gradient(measured.mm, scale), measured.mm)
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
    """Score a way of fitting by leaving surfaces out, fold by fold.

    Which are scored is decided once, for all of them: those that are used. Places, light and model
    of a fold are found without those that it holds out.

    Parameters
    ----------
    surfaces : sequence of KnownSurface
        All that were found, those of no use too.
    without : callable
        From numbers of surfaces that are held out, what the others tell by themselves; None if they
        tell nothing.
    undeformed : Reference
        Held-out surfaces are measured against it.
    fit : callable
        Fits a calibration on some samples and a reference.

    Returns
    -------
    Score, or None with fewer than two surfaces that are used
    """
    if sum(surface.used for surface in surfaces) < 2:
        return None
    progress = progress or Silent()
    folds = min(FOLDS, len(surfaces))
    errors, flat, slopes, height_errors = [], [], [], []
    for fold in range(folds):
        progress.fraction(fold / folds)
        held_out = range(fold, len(surfaces), folds)
        to_score = [i for i in held_out if surfaces[i].used]
        known = without(held_out) if to_score else None
        if known is None:
            continue
        model = fit(known.samples, known.reference)
        seen: dict[int, _Measured] = {}
        for surface in map(known.find, to_score):
            key = id(surface.frame)
            if key not in seen:
                seen[key] = _Measured.of(measured_by(model, surface.frame, undeformed))
            measured = seen[key]
            mask = surface.scored()
            rows, columns, true = surface.true_gradients(mask)
            found = np.stack([measured.gx[rows, columns], measured.gy[rows, columns]], 1)
            errors.append(angles_deg(found, true))
            flat.append(angles_deg(np.zeros_like(true), true))
            slopes.append(np.column_stack([found, true])[:: max(1, len(true) // 200)])
            height_errors.append(surface.height_errors_mm(measured.height_mm, mask))
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
    )
