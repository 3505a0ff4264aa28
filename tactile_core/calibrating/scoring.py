"""Honest scores: every number comes from presses that neither model nor light has seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactile_core.algorithms.poisson import integrate
from tactile_core.calibrating.presses import (
    FoundPress,
    angles_deg,
    light_of,
    relocated,
)
from tactile_core.calibration import Calibration, Press
from tactile_core.progress import Progress, Silent
from tactile_core.quantities import Gradients, HeightMap, Reference

FOLDS = 5


@dataclass(frozen=True, eq=False)
class Score:
    """Held-out errors of a calibration.

    Attributes
    ----------
    presses : int
        How many were scored.
    mean_deg, median_deg, p90_deg : float
        Angle between measured and true normals, over pixels within 0.8 of the contact radius.
    predict_flat_deg : float
        The mean error of saying "flat" everywhere: what the others are to be compared with.
    height_rmse_mm : float
        Of the integrated height against the ball, over the same pixels, up to a constant.
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
    presses: Sequence[FoundPress],
    reference: Reference,
    fit: Callable[[Sequence[Press]], Calibration],
    *,
    relocate: bool = True,
    progress: Progress | None = None,
) -> Score | None:
    """Score a way of fitting by leaving presses out, fold by fold.

    Parameters
    ----------
    presses : sequence of FoundPress
        Those that are used.
    reference : Reference
    fit : callable
        Fits a calibration on some presses.
    relocate : bool
        Find each held-out circle anew with a light fitted to the other presses alone; False where
        the circles are given by labels.

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
        light = light_of(train) if relocate else None
        seen: dict[int, Gradients | HeightMap] = {}
        for press in presses[fold::folds]:
            held_out = press if light is None else relocated(press, light)
            key = id(press.frame)
            if key not in seen:
                seen[key] = model.measure(press.frame, reference)
            measured = seen[key]
            if not isinstance(measured, Gradients):
                continue
            mask = held_out.skin(held_out.scored_radius_px)
            rows, columns, true = held_out.true_gradients(mask)
            found = np.stack([measured.x[rows, columns], measured.y[rows, columns]], 1)
            errors.append(angles_deg(found, true))
            flat.append(angles_deg(np.zeros_like(true), true))
            slopes.append(np.column_stack([found, true])[:: max(1, len(true) // 200)])
            height_errors.append(_height_error(held_out, measured, mask))
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


def _height_error(press: FoundPress, measured: Gradients, mask: np.ndarray) -> np.ndarray:
    height = integrate(measured.x, measured.y, mm_per_px=measured.mm_per_px)
    error = height[mask] - press.true_height_mm(mask)
    return np.asarray(error - error.mean())
