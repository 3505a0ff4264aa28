"""Faster convergence of alternating fits, by what their last steps had in common."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Float64


class MIXING:
    """Parameters of Anderson's mixing.

    Nothing sets them from outside: they have no unit of a sensor.
    """

    # [count] Earlier steps that are compared with the last one. Source: virtual units (ADR 92).
    memory = 3
    # [ratio] Penalty on their weights, over the mean square of their differences. It keeps the
    # mixed step bounded where the differences are noise. Source: virtual units (ADR 92), among
    # 1e-3 and 1e-2.
    ridge = 1e-3


class Mixing:
    """Steps of a fixed-point iteration, mixed as by Anderson [1]_.

    Where a quantity follows another that is fitted to it, each step of an alternation is too short
    by a factor that differs between the directions. How much shorter the steps have become shows
    the factor: the mixed step leads to where they would vanish.

    References
    ----------
    .. [1] D. G. Anderson, "Iterative procedures for nonlinear integral equations", Journal of the
       ACM 12(4), 1965; H. F. Walker and P. Ni, "Anderson acceleration for fixed-point iterations",
       SIAM Journal on Numerical Analysis 49(4), 2011.
    """

    def __init__(self) -> None:
        self._places: list[Float64] = []
        self._steps: list[Float64] = []

    def mixed(self, place: Float64, step: Float64) -> Float64:
        """Return what to add to a place, of which one iteration would add a step; any one shape."""
        self._places = [*self._places, place.ravel()][-MIXING.memory - 1 :]
        self._steps = [*self._steps, step.ravel()][-MIXING.memory - 1 :]
        if len(self._steps) == 1:
            return step
        by_place, by_step = np.diff(self._places, axis=0), np.diff(self._steps, axis=0)
        normal = by_step @ by_step.T
        count = len(normal)
        normal += (MIXING.ridge * np.trace(normal) / count + _TINY) * np.eye(count)
        weights = np.linalg.solve(normal, by_step @ self._steps[-1])
        mixed: Float64 = self._steps[-1] - weights @ (by_place + by_step)
        return mixed.reshape(step.shape)


_TINY = 1e-30  # Keeps the equations regular where nothing moves
