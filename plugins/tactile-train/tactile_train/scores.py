"""Scores of a force network on samples that it has not seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.regression import ONE_SIGMA
from tactile_core.algorithms.arrays.types import Float64

COMPONENTS = "fx", "fy", "fz", "tz"

# Shares of the normal force outside the view up to which a contact is inside it, and visible.
_INSIDE, _VISIBLE = 0.02, 0.1


class ForceScore(NamedTuple):
    """Agreement of estimated and true wrenches.

    Attributes
    ----------
    of : str
        What was scored.
    samples : int
    r2 : (4,) float64
        Coefficient of determination of fx, fy, fz and tz.
    rmse : (4,) float64
        N, N, N and N·mm.
    largest : (4,) float64
        Largest true magnitude of each.
    """

    of: str
    samples: int
    r2: Float64
    rmse: Float64
    largest: Float64

    def summary(self) -> Mapping[str, Any]:
        """Return JSON-ready values."""
        named = {
            name: {"r2": round(float(r2), 4), "rmse": round(float(rmse), 4)}
            for name, r2, rmse in zip(COMPONENTS, self.r2, self.rmse, strict=True)
        }
        return {"of": self.of, "samples": self.samples, **named}


def force_score(of: str, found: Float64, true: Float64) -> ForceScore:
    """Compare (N, 4) estimated with true wrenches."""
    error = found - true
    spread = np.maximum(((true - true.mean(0)) ** 2).sum(0), 1e-12)
    r2 = 1 - (error**2).sum(0) / spread
    return ForceScore(of, len(true), r2, np.sqrt((error**2).mean(0)), np.abs(true).max(0))


def force_scores(
    found: Float64, true: Float64, labels: Sequence[str], outside: Float64
) -> list[ForceScore]:
    """Score the contacts that are visible, in all and by label, those inside the view, and all.

    Parameters
    ----------
    found, true : (N, 4) float64
    labels : sequence of N str
    outside : (N,) float64
        Share of the normal force outside the view; visible contacts have at most a tenth there.
    """
    visible, names = outside <= _VISIBLE, np.asarray(labels)
    chosen = {"at most a tenth of the force outside the view": visible}
    chosen |= {f"of these {name}": visible & (names == name) for name in sorted(set(labels))}
    if not (outside <= _INSIDE).all():
        chosen["contact inside the view"] = outside <= _INSIDE
        chosen["all, also contacts cut further by the border"] = np.ones(len(true), np.bool_)
    return [
        force_score(name, found[these], true[these])
        for name, these in chosen.items()
        if these.any()
    ]


def fitted_std(found: Float64, true: Float64) -> tuple[Float64, Float64]:
    """Fit standard deviations that grow with the force to errors on samples not trained on.

    Of the errors of the smallest forces, 68 % are below the constants; of the others, 68 % are
    below the constants and, added in squares, a share of the force's estimated magnitude.

    Returns
    -------
    floor : (4,) float64
    share : (4,) float64
        For each unit of force.
    """
    error, magnitude = np.abs(found - true), np.linalg.norm(found[:, :3], axis=1)
    small = magnitude <= np.quantile(magnitude, 0.15)  # [share of the samples] small forces
    floor = np.maximum(np.quantile(error[small], ONE_SIGMA, axis=0), 1e-9)
    more = np.sqrt(np.maximum(error[~small] ** 2 - floor**2, 0))
    share = np.quantile(more / magnitude[~small][:, None], ONE_SIGMA, axis=0)
    return floor, share


def covered_share(found: Float64, true: Float64, std: tuple[Float64, Float64]) -> Float64:
    """(4,) share of the errors below one standard deviation, as :func:`fitted_std` gives them."""
    floor, share = std
    magnitude = np.linalg.norm(found[:, :3], axis=1)[:, None]
    return np.asarray((np.abs(found - true) < np.hypot(floor, share * magnitude)).mean(0))
