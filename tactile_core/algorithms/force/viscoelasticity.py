"""Viscoelastic branches, and the grid of all fields."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tactile_core.algorithms.arrays.types import Array, from_middle


@dataclass(frozen=True)
class Branch:
    """A Maxwell branch: a spring in series with a dashpot, parallel to the elastic layer.

    Attributes
    ----------
    modulus_share : float
        Stiffness of the spring relative to the layer's.
    time_s : float
        Relaxation time, s: its stress decays to 1/e.
    """

    modulus_share: float
    time_s: float


@dataclass(frozen=True)
class TimeStep:
    """Viscoelastic behaviour of the layer within one time step.

    The Poisson ratio is constant, so each branch deforms like the layer and its state is the
    stretch of its spring. While the displacement changes linearly from u₀ to u₁ in time t, a
    stretch s becomes s e^(−t/τ) + (u₁ − u₀) β with β = (1 − e^(−t/τ)) τ/t. This is exact for any
    step length.

    Attributes
    ----------
    branches : tuple of Branch
    seconds : float
        Duration; ``inf`` is quasi-static, with all branches relaxed.
    """

    branches: tuple[Branch, ...]
    seconds: float

    @property
    def stiffening(self) -> float:
        """Stiffness of the layer for a displacement added in this step, relative to relaxed."""
        shares = (branch.modulus_share for branch in self.branches)
        return 1.0 + sum(
            share * beta for share, (_, beta) in zip(shares, self._decays, strict=True)
        )

    def residual_displacement(self, displacement: Array, stretches: Array) -> Array:
        """Residual displacement at the end of the step without any load.

        Parameters
        ----------
        displacement : (3, ny, nx)
            At the start of the step, mm.
        stretches : (branches, 3, ny, nx)
            Stretch of the springs at the start of the step, mm.
        """
        residual = np.zeros_like(displacement)
        if np.isinf(self.seconds):
            return residual
        for branch, stretch, (decay, beta) in zip(
            self.branches, stretches, self._decays, strict=True
        ):
            residual += branch.modulus_share * (beta * displacement - decay * stretch)
        return np.asarray(residual / displacement.dtype.type(self.stiffening))

    def advance_stretches(self, stretches: Array, change: Array) -> Array:
        """(branches, 3, ny, nx) stretch at the end, for this ``change`` of the displacement."""
        if np.isinf(self.seconds):
            return np.zeros_like(stretches)
        new = np.empty_like(stretches)
        for stretch, out, (decay, beta) in zip(stretches, new, self._decays, strict=True):
            np.add(decay * stretch, beta * change, out=out, casting="same_kind")
        return new

    @property
    def _decays(self) -> list[tuple[float, float]]:
        if np.isinf(self.seconds):
            return [(0.0, 0.0) for _ in self.branches]
        ratios = [self.seconds / branch.time_s for branch in self.branches]
        return [
            (float(np.exp(-ratio)), float(-np.expm1(-ratio) / ratio) if ratio > 0 else 1.0)
            for ratio in ratios
        ]


@dataclass(frozen=True)
class Memory:
    """What a relaxing surface remembers of its history.

    Attributes
    ----------
    displacement_mm : (3, ny, nx)
        When it was measured last.
    stretches_mm : (branches, 3, ny, nx)
        Of the springs at that time.
    """

    displacement_mm: Array
    stretches_mm: Array

    @classmethod
    def none(cls, branches: tuple[Branch, ...], displacement_mm: Array) -> Memory:
        """Return that of a surface which has been like this for long."""
        return cls(displacement_mm, np.zeros((len(branches), *displacement_mm.shape)))

    def after(self, step: TimeStep, displacement_mm: Array) -> Memory:
        """Return the memory at the end of a step during which the surface moved here."""
        change = displacement_mm - self.displacement_mm
        return Memory(displacement_mm, step.advance_stretches(self.stretches_mm, change))

    def relaxed_mm(self, branches: tuple[Branch, ...]) -> Array:
        """(3, ny, nx) displacement that the same loads cause once all stress has relaxed."""
        shares = [branch.modulus_share for branch in branches]
        return np.asarray(self.displacement_mm + np.tensordot(shares, self.stretches_mm, 1))


@dataclass(frozen=True)
class SurfaceGrid:
    """Rectangular, periodic grid of nodes centred on the image; x right, y down, mm.

    Leave a margin of a few gel thicknesses around the loaded area, because displacements wrap
    around at the borders.

    Attributes
    ----------
    nx, ny : int
        Number of nodes.
    spacing_mm : float
        Distance between adjacent nodes, the same along x and y.
    """

    nx: int
    ny: int
    spacing_mm: float

    @classmethod
    def covering(cls, width_mm: float, height_mm: float, spacing_mm: float) -> SurfaceGrid:
        """Return the smallest grid that covers this area and whose size suits the FFT."""
        from scipy.fft import next_fast_len

        nx, ny = (
            next_fast_len(int(np.ceil(side / spacing_mm)), real=True)
            for side in (width_mm, height_mm)
        )
        return cls(nx, ny, spacing_mm)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of an array on the grid."""
        return self.ny, self.nx

    @property
    def cell_mm2(self) -> float:
        """Area of one node's cell."""
        return self.spacing_mm**2

    @cached_property
    def x_mm(self) -> Array:
        """(nx,) positions of the columns."""
        return from_middle(self.nx) * self.spacing_mm

    @cached_property
    def y_mm(self) -> Array:
        """(ny,) positions of the rows."""
        return from_middle(self.ny) * self.spacing_mm

    @cached_property
    def nodes_mm(self) -> Array:
        """(2, ny, nx) x and y of every node."""
        return np.stack(np.meshgrid(self.x_mm, self.y_mm))
