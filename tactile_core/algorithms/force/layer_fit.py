"""Fits loads to a measured surface, with their standard errors."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Float32, Float64, from_middle
from tactile_core.algorithms.force.elastic_layer import ElasticLayer, Elastomer
from tactile_core.algorithms.force.surface_loads import (
    Deformation,
    Shares,
    SurfaceLoads,
    surface_loads,
)
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid


class LAYER_FIT:
    """Parameters of the fit. Nothing sets them from outside: they are ratios."""

    # [ratio] Added to 1 − 2ν before its logarithm, in which displacement is nearly linear.
    # Source: virtual rigs: where the slopes on both sides of ν = 0.48 are equal.
    softness = 0.02
    # [count] Steps towards the fit after the first linearisation. Source: virtual rigs: the third
    # changes the force by less than 1 %.
    steps = 2
    # [ratio] Thickness changes at most by this factor. Source: by hand: a profile that is
    # further off is wrong.
    greatest = 1.5
    # [ratio] Poisson's ratio stays between these. Source: physics: no silicone is more
    # compressible, and 0.5 is incompressible.
    ratios = (0.3, 0.4995)


_STEPS = 0.05, 0.3  # Steps of the derivatives: logarithms of the thickness, and of the softness


class FittedLayer(NamedTuple):
    """The layer that explains a deformation best, and its loads.

    Attributes
    ----------
    elastomer : Elastomer
    loads : SurfaceLoads
    covariance : (4, 4) float64
        Of the loads' resultant, by what remains unknown of thickness and Poisson's ratio.
    """

    elastomer: Elastomer
    loads: SurfaceLoads
    covariance: Float64


class _Trial(NamedTuple):
    elastomer: Elastomer
    loads: SurfaceLoads
    residual_mm: Array


class LayerFit:
    """Fits thickness and Poisson's ratio to the displacement beside the contact.

    Least squares by two chords [1]_, with the nominal values as a normal prior.

    Parameters
    ----------
    grid : SurfaceGrid
        With the spacing of the cells, larger than the view.
    nominal : Elastomer
        Its modulus scales all loads and changes no displacement, so that it cannot be fitted.
    tolerance : float
        Relative standard deviation of the nominal values.

    References
    ----------
    .. [1] J. E. Dennis and R. B. Schnabel, "Numerical Methods for Unconstrained Optimization and
       Nonlinear Equations", SIAM, 1996, chapter 10.
    """

    def __init__(self, grid: SurfaceGrid, nominal: Elastomer, tolerance: float) -> None:
        self._grid, self._nominal = grid, nominal
        self._start = start = _softness(nominal.poisson_ratio)
        reach = np.log(LAYER_FIT.greatest)
        softest, hardest = (_softness(ratio) - start for ratio in LAYER_FIT.ratios)
        self._bounds = np.array([-reach, hardest]), np.array([reach, softest])
        spread = np.array([tolerance, tolerance * nominal.poisson_ratio * 2 / np.exp(start)])
        self._prior = np.diag(spread**-2)
        self._layers = [self._layer(way) for way in (np.zeros(2), *np.diag(_STEPS))]

    def fit(self, measured: Deformation, shares: Shares) -> FittedLayer:
        """Return the layer that explains a deformation best, and the loads on it.

        Parameters
        ----------
        measured : Deformation
            With contact.
        shares : Shares
            Of the contact.
        """
        beside = measured.valid & ~_grow_contact(measured.contact)
        waves, cell_mm = self._layers[0].waves(shares.planes), self._grid.spacing_mm

        def tried(
            layer: ElasticLayer, start: SurfaceLoads | None, held_mm2: float | None = None
        ) -> _Trial:
            loads = surface_loads(
                layer, measured, shares, cell_mm, waves=waves, start=start, held_mm2=held_mm2
            )
            return _Trial(layer.elastomer, loads, loads.unexplained_mm[:, beside].ravel())

        last, *others = (tried(layer, None) for layer in self._layers)
        slopes, forces = (
            np.stack([(one - former) / by for one, by in zip(stepped, _STEPS, strict=True)])
            for former, stepped in (
                (last.residual_mm, [one.residual_mm for one in others]),
                (last.loads.resultant, [one.loads.resultant for one in others]),
            )
        )
        weight = _weight(
            measured.shift_mm[:, beside], self._grid.spacing_mm, self._nominal.thickness_mm
        )
        precision = weight * slopes @ slopes.T + self._prior
        held_mm2 = _held_mm2(measured, weight)
        way = np.zeros(2)
        for step in range(LAYER_FIT.steps):
            down = weight * slopes @ last.residual_mm + self._prior @ way
            way = np.clip(way - np.linalg.solve(precision, down), *self._bounds)
            ends = step + 1 == LAYER_FIT.steps
            last = tried(self._layer(way), last.loads, held_mm2 if ends else None)
        covariance = forces.T @ np.linalg.inv(precision) @ forces
        return FittedLayer(last.elastomer, last.loads, covariance)

    def _layer(self, way: Float64) -> ElasticLayer:
        """Return the layer at logarithms of the thickness and of the softness, from the start."""
        elastomer = Elastomer(
            self._nominal.thickness_mm * float(np.exp(way[0])),
            self._nominal.shear_modulus_mpa,
            _ratio(self._start + float(way[1])),
        )
        return ElasticLayer(self._grid, elastomer)


def _weight(shift_mm: Array, cell_mm: float, thickness_mm: float) -> float:
    """Return one over the variance of a residual, in units of independent ones.

    What the layer does not explain is alike within a thickness.
    """
    if not shift_mm.size:
        return 0.0
    moved_mm2 = float((shift_mm**2).mean())
    # [mm] displacements without contact on virtual rigs, and [share] the model's error there
    # (``experiments/elastic_force.py``)
    variance = 0.001**2 + 0.1**2 * moved_mm2
    independent = min(1.0, (cell_mm / thickness_mm) ** 2)
    return independent / variance


def _held_mm2(measured: Deformation, weight: float) -> float | None:
    """Return how firmly the height holds the pressure; None if no displacement is measured."""
    if weight == 0:
        return None
    mean_mm = float(np.average(measured.indentation_mm, weights=measured.contact))
    # [share] of a touch of at most 0.07 mm; the error falls with the square: virtual balls of 8 to
    # 30 mm have 0.11, 0.05 and 0.02 at 0.09, 0.13 and 0.27 mm
    error = 0.15 / max(1.0, mean_mm / 0.07) ** 2
    return 1 / (weight * error**2)


def _softness(poisson_ratio: float) -> float:
    return float(np.log(1 + LAYER_FIT.softness - 2 * poisson_ratio))


def _ratio(softness: float) -> float:
    return (1 + LAYER_FIT.softness - float(np.exp(softness))) / 2


def _grow_contact(contact: Bool | Float32) -> Bool:
    """Return the contact and the cells next to it, where the measured border is uncertain."""
    touching = (contact > 0.5).astype(np.uint8)
    return np.asarray(cv2.dilate(touching, np.ones((3, 3), np.uint8)), np.bool_)


class LOAD_ERRORS:
    """Standard deviations of what the model leaves out. Nothing sets them from outside."""

    # [share] Of a component, relative to its size: errors of contact, height and traction; the
    # torque is that about the middle of the contact. Source: maximum likelihood on four virtual
    # units (``experiments/elastic_force.py``).
    shear = 0.025
    normal = 0.05
    torque = 0.09
    # [share of the normal force] Shear force that is found while an object is pressed straight
    # down: the height is measured slightly tilted. Source: as above; 0.06 to 0.15 % of each
    # shape's normal force.
    tilt = 0.0008
    # [thicknesses] Displacement that the layer does not explain is alike within this distance.
    # Source: as above.
    alike = 0.7
    # [share] Part of that displacement which turns about the contact. The rest points away from
    # it or along it, and exerts no torque. Source: as above: torque of objects that are not
    # twisted.
    twisting = 0.3
    # [N] Least standard deviation of a force. Source: as above, for the lightest touches.
    least_n = 0.0005


def load_variance(
    fit: FittedLayer, measured: Deformation, cell_mm: float, tolerance: float
) -> Float64:
    """Return the variance of fx, fy, fz in N² and of tz in N² mm².

    The torque about the image centre is that about the middle of the contact, and the shear force
    times its lever; the errors of both are independent, because the one comes from displacement
    that turns and the other from displacement that does not.

    Parameters
    ----------
    fit : FittedLayer
        Its resultant refers to the middle of the cells.
    measured : Deformation
        With contact.
    cell_mm : float
        Side of a cell.
    tolerance : float
        Relative standard deviation of the gel's modulus.
    """
    loads, errors = fit.loads, LOAD_ERRORS
    x_mm, y_mm = _middle_mm(measured, cell_mm)
    about = np.array([y_mm, -x_mm, 0, 1])  # torque about the middle of the contact
    apart = np.vstack([np.eye(4)[:3], about])
    relative = np.array([errors.shear, errors.shear, errors.normal, errors.torque])
    variance = (relative * (apart @ loads.resultant)) ** 2
    if measured.valid.any():
        unexplained = float((loads.unexplained_mm[:, measured.valid] ** 2).mean())
        alike_mm = errors.alike * fit.elastomer.thickness_mm
        cells = max(1.0, (alike_mm / cell_mm) ** 2)
        scale = np.array([1, 1, 1, errors.twisting**2])
        variance += cells * unexplained * scale * np.diag(apart @ loads.covariance @ apart.T)
    variance[:3] += errors.least_n**2
    variance[:2] += (errors.tilt * loads.resultant[2]) ** 2
    variance[3] += x_mm**2 * variance[1] + y_mm**2 * variance[0]
    gel = (tolerance * loads.resultant) ** 2 + np.diag(fit.covariance)
    return np.asarray(variance + gel)


def _middle_mm(measured: Deformation, cell_mm: float) -> tuple[float, float]:
    """Return x and y of the middle of the contact, relative to that of the cells."""
    contact = measured.contact.astype(np.float64)
    rows, columns = contact.shape
    x, y = contact.sum(0) @ from_middle(columns), contact.sum(1) @ from_middle(rows)
    return float(x / contact.sum() * cell_mm), float(y / contact.sum() * cell_mm)
