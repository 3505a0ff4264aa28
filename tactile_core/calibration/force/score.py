"""How well a force model predicts sequences that it was not fitted on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.interfaces.force_calibration import COMPONENTS, ForceModel, ForceSamples
from tactile_core.interfaces.progress import Progress, Silent

Fit = Callable[[Sequence[ForceSamples]], ForceModel]


class Proportionality(NamedTuple):
    """The single feature that a component is most nearly proportional to.

    Attributes
    ----------
    feature : str
    slope : float
        N or N·mm per unit of the feature.
    r2 : float
        Of ``slope · feature``, on the frames that it was fitted to.
    """

    feature: str
    slope: float
    r2: float


class ComponentScore(NamedTuple):
    """Score of one component on held-out sequences.

    Attributes
    ----------
    r2 : float
    rmse : float
        N or N·mm.
    percent_of_range : float
        RMSE in per cent of the range of the true force.
    within_std : float
        Share of the errors within one standard deviation; 0.68 if that is right.
    proportional : Proportionality or None
        None if the features have no names.
    """

    r2: float
    rmse: float
    percent_of_range: float
    within_std: float
    proportional: Proportionality | None

    def summary(self) -> dict[str, Any]:
        """Return it as JSON-ready values."""
        proportional = None if self.proportional is None else self.proportional._asdict()
        return {**self._asdict(), "proportional": proportional}


def held_out_forces(
    sequences: Sequence[ForceSamples], fit: Fit, progress: Progress | None = None
) -> tuple[Float64, Float64]:
    """Predict each sequence by a model that was fitted on the others alone.

    Returns
    -------
    forces, std : (N, 4) float64
        In the order of the sequences.
    """
    progress = progress or Silent()
    found = []
    for index, one in enumerate(sequences):
        model = fit([other for other in sequences if other is not one])
        found.append(model.forces(one.features))
        progress.fraction((index + 1) / len(sequences))
    forces, std = zip(*found, strict=True)
    return np.concatenate(forces), np.concatenate(std)


def scored(
    sequences: Sequence[ForceSamples],
    found: Float64,
    std: Float64,
    names: Sequence[str] = (),
) -> dict[str, ComponentScore]:
    """Score predictions against the forces of their sequences, by component."""
    features = np.concatenate([one.features for one in sequences])
    true = np.concatenate([one.forces for one in sequences])
    scores = {}
    for column, component in enumerate(COMPONENTS):
        known = np.isfinite(true[:, column]) & np.isfinite(found[:, column])
        if known.sum() < 2:
            continue
        force, miss = true[known, column], (found - true)[known, column]
        rmse = float(np.sqrt((miss**2).mean()))
        scores[component] = ComponentScore(
            _r2(force, miss),
            rmse,
            100 * rmse / max(float(np.ptp(force)), 1e-300),
            float((np.abs(miss) <= std[known, column]).mean()),
            _proportional(features[known], force, names),
        )
    return scores


def _proportional(
    features: Float64, force: Float64, names: Sequence[str]
) -> Proportionality | None:
    found = []
    for column, name in enumerate(names):
        one = features[:, column]
        size = float(one @ one)
        if np.isfinite(size) and size > 0:
            slope = float(one @ force) / size
            found.append(Proportionality(name, slope, _r2(force, slope * one - force)))
    return max(found, key=lambda one: one.r2, default=None)


def _r2(force: Float64, miss: Float64) -> float:
    return 1 - float(miss @ miss) / max(float(((force - force.mean()) ** 2).sum()), 1e-300)
