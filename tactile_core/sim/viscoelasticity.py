"""How the gel's stress fades while its shape is held: a Prony series."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Array


@dataclass(frozen=True)
class Branch:
    """A spring in series with a dashpot, beside the elastic layer.

    Attributes
    ----------
    modulus_share : float
        Stiffness of the spring, as a share of the layer's.
    time_s : float
        Time in which its stress falls to 1/e.
    """

    modulus_share: float
    time_s: float


@dataclass(frozen=True)
class TimeStep:
    """The layer within one step in time.

    The Poisson ratio does not change with time, so each branch deforms as the layer does and only
    one number for each is needed: by how much its spring is stretched. A spring that was stretched
    by s, while the displacement goes evenly from u₀ to u₁, ends at s e^(−t/τ) + (u₁ − u₀) β with
    β = (1 − e^(−t/τ)) τ/t, whatever the step's length.

    Attributes
    ----------
    branches : tuple of Branch
    seconds : float
        ``inf`` is a quasi-static step: all branches have relaxed.
    """

    branches: tuple[Branch, ...]
    seconds: float

    @property
    def stiffening(self) -> float:
        """How much stiffer than in the end the layer is for what is added in this step."""
        shares = (branch.modulus_share for branch in self.branches)
        return 1.0 + sum(
            share * beta for share, (_, beta) in zip(shares, self._fading, strict=True)
        )

    def remembered(self, displacement: Array, stretches: Array) -> Array:
        """Displacement that is left at the end of the step with no load at all.

        Parameters
        ----------
        displacement : (3, ny, nx)
            At the start of the step, mm.
        stretches : (branches, 3, ny, nx)
            Of the springs, at its start, mm.
        """
        left = np.zeros_like(displacement)
        if np.isinf(self.seconds):
            return left
        for branch, stretch, (faded, beta) in zip(
            self.branches, stretches, self._fading, strict=True
        ):
            left += branch.modulus_share * (beta * displacement - faded * stretch)
        return np.asarray(left / displacement.dtype.type(self.stiffening))

    def stretched(self, stretches: Array, change: Array) -> Array:
        """(branches, 3, ny, nx) stretch at the end, for a displacement that grew by ``change``."""
        if np.isinf(self.seconds):
            return np.zeros_like(stretches)
        new = np.empty_like(stretches)
        for stretch, out, (faded, beta) in zip(stretches, new, self._fading, strict=True):
            np.add(faded * stretch, beta * change, out=out, casting="same_kind")
        return new

    @property
    def _fading(self) -> list[tuple[float, float]]:
        if np.isinf(self.seconds):
            return [(0.0, 0.0) for _ in self.branches]
        ratios = [self.seconds / branch.time_s for branch in self.branches]
        return [
            (float(np.exp(-ratio)), float(-np.expm1(-ratio) / ratio) if ratio > 0 else 1.0)
            for ratio in ratios
        ]
