"""The loads on a gel that explain its measured surface.

Slopes are measured best inside contacts, where the calibration has seen them, and where the gel is
nearly flat. In between, where the gel leaves an object, the object's shadow looks like a slope. But
a gel has no shape of its own there: what presses on the contact determines it.
"""

from __future__ import annotations

from functools import lru_cache
from math import ceil
from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Float32
from tactile_core.algorithms.force.elastic_layer import POISSON_RATIO, Elastomer
from tactile_core.algorithms.poisson.screened import cosines, differences

# [gel thicknesses] Gel without loads beyond each side of the view; then come mirror images. With
# half as much, peaks of virtual objects are up to 0.4 % lower
_PADDING_THICKNESSES = 1.0
# [slope] Smaller slopes are measured well with or without contact; 0.06 to 0.2 move the median
# error of virtual peaks by at most 0.8 %
_CERTAIN_SLOPE = 0.1
# [share of the greatest pressure] Where less presses, slopes may be those of a shadow; 0.35 to 0.7
# move the median error of virtual peaks by at most 0.5 %
_PRESSED_SHARE = 0.5
# [ratio] Weight of such a slope: with 0, loads at the border of a contact are undetermined; with
# 0.01, heights are 1.5 % too high instead of 0.5 %
_SHADOW_WEIGHT = 1e-3
# [rounds] of conjugate gradients each time; fifteen times as many move the median error of virtual
# peaks by at most 0.7 %
_ROUNDS = 4

Steps = tuple[Float32, Float32]
"""Values between neighbours: (h, w - 1) to the right, and (h - 1, w) down."""


class _Layer(NamedTuple):
    """Elastic layer on a grid of cells, in the cosine waves of its sides.

    Attributes
    ----------
    down, across : (m, h), (n, w) float32
        Waves of the padded grid at the cells in view, one a row.
    compliance : (m, n) float32
        Indentation per pressure of each wave, 1 for the softest.
    inverse : (m, n) float32
        One over the sum of squared slopes per squared pressure: the preconditioner.
    """

    down: Float32
    across: Float32
    compliance: Float32
    inverse: Float32

    def filter(self, values: Float32, gains: Float32) -> Float32:
        """Multiply waves by gains; for so few cells, matrices are faster than fast transforms."""
        waves = gains * (self.down @ values @ self.across.T)
        return np.asarray(self.down.T @ waves @ self.across, np.float32)


class Explained(NamedTuple):
    """Part of a surface that loads explain.

    Attributes
    ----------
    cells_mm : (h, w) float32
        Height, 0 far from all loads.
    weights : (h, w - 1) and (h - 1, w) float32
        Of the steps to the right and down: 1 where the measured slope was believed, and hardly
        more than 0 where it may be that of a shadow.
    """

    cells_mm: Float32
    weights: Steps


def explain_by_loads(
    cells_mm: Array, slope: Array, loaded: Bool, cell: tuple[float, float]
) -> Explained:
    """Return the surface of an elastic layer under the pressure that fits a measured surface best.

    The pressure p ≥ 0 on the loaded cells minimises Σ weight · |∇(compliance · p) − ∇cells|²,
    twice: with equal weights, which show where the gel is pressed, and then with a small weight
    where it is steep though hardly pressed. Only differences of heights count. Modulus and scale of
    the layer cancel out.

    Parameters
    ----------
    cells_mm : (h, w)
        Measured height, positive where pressed: means over cells.
    slope : (h, w)
        Size of its slope, dimensionless.
    loaded : (h, w) bool
        Cells that may be pressed.
    cell : (float, float)
        Height and width of a cell in thicknesses of the gel.
    """
    pressure = np.zeros(cells_mm.shape, np.float32)
    weights = _between(np.ones_like(pressure))
    if not loaded.any():
        return Explained(pressure, weights)
    layer = _layer(cells_mm.shape, cell)
    # other contacts may be pressed harder
    near = np.ones([2 * int(1 / side) + 1 for side in cell], np.uint8)
    for _ in range(2):
        pressure = _fit(layer, cells_mm, weights, pressure, loaded)
        loaded = pressure > 0
        pressed = pressure > _PRESSED_SHARE * cv2.dilate(pressure, near)
        certain = pressed | (slope < _CERTAIN_SLOPE)
        weights = _between(np.where(certain, np.float32(1), np.float32(_SHADOW_WEIGHT)))
    return Explained(layer.filter(pressure, layer.compliance), weights)


def _fit(layer: _Layer, cells_mm: Array, weights: Steps, pressure: Float32, free: Bool) -> Float32:
    """Improve a pressure on free cells by conjugate gradients, and cut it off at 0."""

    def weigh(surface: Array) -> Float32:
        right, down = steps(surface)
        return gather((weights[0] * right, weights[1] * down))

    rest_mm = cells_mm - layer.filter(pressure, layer.compliance) if pressure.any() else cells_mm
    residual = free * layer.filter(weigh(rest_mm), layer.compliance)
    solved = free * layer.filter(residual, layer.inverse)
    direction, left = solved, float(np.vdot(residual, solved))
    for _ in range(_ROUNDS):
        if left <= 0:
            break
        moved = layer.filter(direction, layer.compliance)
        weighed = weigh(moved)
        step = left / float(np.vdot(moved, weighed))
        pressure = pressure + step * direction
        residual = residual - step * (free * layer.filter(weighed, layer.compliance))
        solved = free * layer.filter(residual, layer.inverse)
        before, left = left, float(np.vdot(residual, solved))
        direction = solved + left / before * direction
    return np.maximum(pressure, 0)


def _between(weight: Float32) -> Steps:
    """Return the geometric means of the weights of neighbours."""
    return np.sqrt(weight[:, 1:] * weight[:, :-1]), np.sqrt(weight[1:] * weight[:-1])


def steps(surface: Array) -> Steps:
    """Return the differences of neighbours of an (h, w) surface."""
    return surface[:, 1:] - surface[:, :-1], surface[1:] - surface[:-1]


def gather(values: Steps) -> Float32:
    """Return the sum, for each of (h, w) cells, of steps towards it minus those away from it.

    Of the steps of a surface z it is ``Σ (z − neighbour)``.
    """
    right, down = values
    out = np.zeros((len(right), down.shape[1]), np.float32)
    out[:, :-1] -= right
    out[:, 1:] += right
    out[:-1] -= down
    out[1:] += down
    return out


@lru_cache(maxsize=16)
def _layer(shape: tuple[int, ...], cell: tuple[float, float]) -> _Layer:
    """Layer of thickness 1 on a grid."""
    (down, of_down), (across, of_across) = (
        cosines(count, ceil(_PADDING_THICKNESSES / side))
        for count, side in zip(shape, cell, strict=True)
    )
    layer = Elastomer(thickness_mm=1.0, shear_modulus_mpa=1.0, poisson_ratio=POISSON_RATIO)
    wave_number = np.hypot(of_down[:, None] / cell[0], of_across / cell[1])
    compliance = layer.compliance(wave_number).normal
    compliance /= compliance.max()
    stiffness = differences(of_down, of_across) * compliance**2
    # [share of the greatest] long waves hardly have slopes
    inverse = 1 / (stiffness + 0.1 * stiffness.max())
    return _Layer(*(part.astype(np.float32) for part in (down, across, compliance, inverse)))
