"""Honest scores: every number comes from presses that neither model nor light has seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from tactile_core.algorithms.poisson import integrate
from tactile_core.calibrating.presses import angles_deg
from tactile_core.calibrating.surface import KnownSurface
from tactile_core.calibration import Calibration, Press, measured_by
from tactile_core.progress import Progress, Silent
from tactile_core.quantities import Gradients, HeightMap, Reference

FOLDS = 5

S = TypeVar("S", bound=KnownSurface)


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
        Of the integrated height against the true one, over the same pixels, up to what no slope
        tells: a constant, and a height map's tilt.
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


def cross_validate(
    presses: Sequence[S],
    reference: Reference,
    fit: Callable[[Sequence[Press]], Calibration],
    *,
    anew: Callable[[Sequence[S]], Callable[[S], S]] | None = None,
    progress: Progress | None = None,
) -> Score | None:
    """Score a way of fitting by leaving presses out, fold by fold.

    Parameters
    ----------
    presses : sequence of KnownSurface
        Those that are used.
    reference : Reference
    fit : callable
        Fits a calibration on some presses.
    anew : callable, optional
        From the other presses alone, how to find a held-out one again; None where its place was
        given, as by labels or a target.

    Returns
    -------
    Score, or None with fewer than two presses
    """
    if len(presses) < 2:
        return None
    progress = progress or Silent()
    folds = min(FOLDS, len(presses))
    errors, flat, slopes, height_errors = [], [], [], []
    for fold in range(folds):
        train = [press for i, press in enumerate(presses) if i % folds != fold]
        model = fit([press.training() for press in train])
        find = None if anew is None else anew(train)
        seen: dict[int, Gradients | HeightMap] = {}
        for press in presses[fold::folds]:
            held_out = press if find is None else find(press)
            key = id(press.frame)
            if key not in seen:
                seen[key] = measured_by(model, press.frame, reference)
            measured = seen[key]
            if not isinstance(measured, Gradients):
                continue
            mask = held_out.scored()
            rows, columns, true = held_out.true_gradients(mask)
            found = np.stack([measured.x[rows, columns], measured.y[rows, columns]], 1)
            errors.append(angles_deg(found, true))
            flat.append(angles_deg(np.zeros_like(true), true))
            slopes.append(np.column_stack([found, true])[:: max(1, len(true) // 200)])
            height_mm = integrate(measured.x, measured.y, mm_per_px=measured.mm_per_px)
            height_errors.append(held_out.height_errors_mm(height_mm, mask))
        progress.fraction((fold + 1) / folds)
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
