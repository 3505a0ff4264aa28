"""How well a calibration predicts held-out presses."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple

import numpy as np

from tactile_core.calibration.crew import Task
from tactile_core.calibration.presses import angles_deg
from tactile_core.calibration.result import Fold, measured_frames
from tactile_core.calibration.score import HeldOutSurface, Score, fitted_errors
from tactile_core.calibration.target_surface import MeasuredSphere, S
from tactile_core.interfaces.calibration import Calibration, Press
from tactile_core.quantities import Reference

# Fits a calibration to training samples and a reference.
Fit = Callable[[Sequence[Press], Reference], Calibration]


@dataclass(frozen=True, eq=False)
class Trials(Generic[S]):
    """Surfaces, and how a calibration is fitted without some of them.

    Attributes
    ----------
    surfaces : sequence of TargetSurface
        All that were found, unusable ones included.
    without : callable
        Maps indices of held-out surfaces to a :class:`Fold` of the others; None if none of the
        others can be used.
    reference : Reference
        Held-out surfaces are measured against it.
    fit : callable
        Fits a calibration to training samples and a reference.
    thickness_mm : float
        Thickness of the gel.
    undeformed : tuple of Press
        Additional training samples of the undeformed gel surface.
    """

    surfaces: Sequence[S]
    without: Callable[[Collection[int]], Fold[S] | None]
    reference: Reference
    fit: Fit
    thickness_mm: float
    undeformed: tuple[Press, ...] = ()

    @property
    def used(self) -> list[int]:
        """Indices of the surfaces that are good enough to fit on."""
        return [i for i, surface in enumerate(self.surfaces) if surface.used]

    def fit_all(self) -> Calibration:
        """Fit a calibration to all surfaces that are used."""
        training = [self.surfaces[i].training() for i in self.used]
        return self.fit([*training, *self.undeformed], self.reference)


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


# [count] Folds of the cross-validation, at most. Source: by hand, the usual number of folds.
FOLDS = 5


class HeldOut(NamedTuple):
    """What a calibration measures of a surface that it has not seen.

    Attributes
    ----------
    found, true : (N, 2) float
        Measured and true slopes of the scored pixels.
    height_errors_mm : (N,) float
        Measured minus true height there, less their mean difference.
    surface : HeldOutSurface or None
        None if heights are measured directly.
    sphere : MeasuredSphere or None
    """

    found: np.ndarray
    true: np.ndarray
    height_errors_mm: np.ndarray
    surface: HeldOutSurface | None
    sphere: MeasuredSphere | None


@dataclass(frozen=True, eq=False)
class CrossValidation:
    """Independent calibrations on parts of the surfaces, and the score that they yield [1]_.

    The surfaces to score are selected once: those that are used. Circles, light model and
    calibration of a fold are estimated without the surfaces that it holds out.

    Attributes
    ----------
    trials : Trials
    folds : list of range
        Indices of the surfaces that each fold holds out.
    sizes : list of float
        Diameters of balls that are each left out, if there are several.

    References
    ----------
    .. [1] M. Stone, "Cross-Validatory Choice and Assessment of Statistical Predictions", Journal of
       the Royal Statistical Society B 36(2), 1974.
    """

    trials: Trials[Any]
    folds: list[range]
    sizes: list[float]

    @classmethod
    def from_trials(cls, trials: Trials[Any]) -> CrossValidation:
        """Divide the surfaces; with fewer than two usable ones there is nothing to do."""
        used, count = trials.used, len(trials.surfaces)
        if len(used) < 2:
            return cls(trials, [], [])
        folds = min(FOLDS, count)
        ranges = [range(fold, count, folds) for fold in range(folds)]
        return cls(trials, ranges, sizes_of(trials))

    @property
    def tasks(self) -> list[Task]:
        """All calibrations, for :meth:`Crew.run` with the trials."""
        return [
            *(Task(measured_fold, (fold,)) for fold in self.folds),
            *(Task(ratios_of_left_out_size, (size,)) for size in self.sizes),
        ]

    def score(self, results: Sequence[Any]) -> Score | None:
        """Combine the results of the tasks; None without any measured pixel."""
        folds = len(self.folds)
        held_out = {i: one for fold in results[:folds] for i, one in fold.items()}
        errors = [angles_deg(one.found, one.true) for one in held_out.values()]
        if not sum(map(len, errors)):
            return None
        all_errors = np.concatenate(errors)
        flat = [angles_deg(np.zeros_like(one.true), one.true) for one in held_out.values()]
        height_errors = np.concatenate([one.height_errors_mm for one in held_out.values()])
        return Score(
            presses=len(errors),
            mean_deg=float(all_errors.mean()),
            median_deg=float(np.median(all_errors)),
            p90_deg=float(np.percentile(all_errors, 90)),
            predict_flat_deg=float(np.concatenate(flat).mean()),
            height_rmse_mm=float(np.sqrt(np.mean(height_errors**2))),
            samples=np.concatenate([_some(one) for one in held_out.values()]).astype(np.float32),
            errors=fitted_errors(o.surface for o in held_out.values() if o.surface is not None),
            spheres={i: one.sphere for i, one in held_out.items() if one.sphere is not None},
            left_out_size_ratio=left_out_size_ratio(results[folds:]),
        )


def measured_fold(trials: Trials[S], held_out: Sequence[int]) -> dict[int, HeldOut]:
    """Measure the used surfaces among some, by a calibration on the others."""
    to_score = [i for i in held_out if trials.surfaces[i].used]
    training = trials.without(held_out) if to_score else None
    if training is None:
        return {}
    model = trials.fit(training.samples, training.reference)
    results = {}
    found_again = measured_frames(model, map(training.find, to_score), trials.reference)
    for i, (surface, measured) in zip(to_score, found_again, strict=True):
        mask = surface.scored_area()
        rows, columns, true = surface.true_gradients(mask)
        shape = measured.gx, measured.gy, measured.height_mm
        results[i] = HeldOut(
            np.stack([measured.gx[rows, columns], measured.gy[rows, columns]], 1),
            true,
            surface.height_errors_mm(measured.height_mm, mask),
            HeldOutSurface(*shape, surface.training(), trials.thickness_mm)
            if measured.integrated
            else None,
            surface.sphere(measured.height_mm),
        )
    return results


def _some(one: HeldOut) -> np.ndarray:
    """Measured and true slopes (N, 4) of some pixels, for the report."""
    step = max(1, len(one.true) // 200)  # [count] Pixels of each surface that the report plots
    return np.column_stack([one.found, one.true])[::step]
