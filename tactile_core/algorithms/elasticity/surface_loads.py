"""Pressure and shear traction of a contact, from the displacement that they cause."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.places import from_middle
from tactile_core.algorithms.arrays.types import Array, Bool, Float32, Float64
from tactile_core.algorithms.elasticity.response import Response


class SurfaceLoadParameters(NamedTuple):
    """Parameters of the inversion. Nothing sets them from outside: they are ratios.

    Attributes
    ----------
    damping : float, share of the largest compliance
        Added to the normal compliance of every wave, so that noise of the height does not become
        pressure.
        Source: virtual rigs (``experiments/elastic_force.py``).
    most_steps : int, count
        Steps of the conjugate gradients, at most.
        Source: virtual rigs: about ten are needed.
    residual : float, ratio
        The pressure is found when it indents the surface as measured but for this share.
        Source: chosen by hand: less than what the height is known by.
    degree : int, count
        Degree of the polynomial in each component of the shear traction.
        Source: virtual rigs: 3 also follows a twist that slips at its rim, which 2 does not.
    ridge : float, share
        Added to the diagonal of the normal equations, so that small contacts determine them.
        Source: chosen by hand.
    """

    damping: float = 0.004
    most_steps: int = 25
    residual: float = 1e-2
    degree: int = 3
    ridge: float = 1e-4


SURFACE_LOADS = SurfaceLoadParameters()
"""The values in use."""


class Deformation(NamedTuple):
    """What is measured of a deformed surface, on the cells of a grid.

    Attributes
    ----------
    indentation_mm : (h, w)
    shift_mm : (2, h, w)
        Displacement along x and y.
    valid : (h, w) bool
        Where the displacement is measured.
    contact : (h, w) bool
    """

    indentation_mm: Array
    shift_mm: Array
    valid: Bool
    contact: Bool


class Shares(NamedTuple):
    """Polynomials in the contact, of which the shear traction is made.

    Attributes
    ----------
    planes : (n, h, w) float32
        Powers of x and y, relative to the middle and size of the contact; 0 outside it.
    arms : (3, 2 n) float64
        Force along x, along y (mm²) and torque (mm³) of each plane as a traction of 1 along x, then
        of each along y.
    """

    planes: Float32
    arms: Float64

    @classmethod
    def of(cls, contact: Bool, cell_mm: float) -> Shares:
        """Return the polynomials of a contact on cells of this side."""
        rows, columns = np.nonzero(contact)
        y, x = (
            (np.arange(size) - found.mean()) / max(float(found.std()), 1.0)
            for size, found in zip(contact.shape, (rows, columns), strict=True)
        )
        degree = SURFACE_LOADS.degree
        powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
        planes = np.stack([x**i * (y**j)[:, None] for i, j in powers]) * contact
        x_mm, y_mm = (from_middle(size) * cell_mm for size in contact.shape[::-1])
        force = planes.sum((1, 2))
        none = np.zeros_like(force)
        torque = np.concatenate([-planes.sum(2) @ y_mm, planes.sum(1) @ x_mm])
        arms = np.stack([np.r_[force, none], np.r_[none, force], torque]) * cell_mm**2
        return cls(planes.astype(np.float32), arms)


class SurfaceLoads(NamedTuple):
    """Loads in a contact, and what they leave unexplained.

    Attributes
    ----------
    pressure_mpa : (h, w)
    weights : (2 n,) float64
        Of each plane of the shares as a traction along x, then of each along y, in MPa.
    resultant : (4,) float64
        Fx, fy, fz in N and tz in N·mm about the middle of the cells.
    unexplained_mm : (2, h, w)
        Measured displacement less the one that the loads cause; 0 where none is measured.
    covariance : (4, 4) float64
        Of the resultant, if the errors of the displacement of all cells are independent and have a
        standard deviation of 1 mm.
    """

    pressure_mpa: Array
    weights: Float64
    resultant: Float64
    unexplained_mm: Array
    covariance: Float64

    def traction_mpa(self, shares: Shares) -> Float64:
        """(2, h, w) shear traction along x and y."""
        return np.tensordot(self.weights.reshape(2, -1), shares.planes, 1)


def surface_loads(
    response: Response,
    measured: Deformation,
    shares: Shares,
    cell_mm: float,
    *,
    held_mm2: float | None = None,
) -> SurfaceLoads:
    """Return the loads in the contact that deform the surface as measured.

    The shear traction is found by least squares, after the outward spread that the pressure causes
    has been subtracted. It is zero if no displacement is measured. How far the pressure spreads the
    surface also shows by which factor the height is wrong, if ``held_mm2`` is given.

    Parameters
    ----------
    response : Response
        Of the gel's surface, on a grid with the spacing of the cells and a margin.
    measured : Deformation
        With contact.
    shares : Shares
        Of this contact.
    cell_mm : float
        Side of a cell.
    held_mm2 : float, optional
        Variance of the displacement of a cell over that of a factor on the pressure, which is then
        fitted. Default: the pressure is that of the height.
    """
    pressure = pressure_mpa(response, measured.indentation_mm, measured.contact)
    spread = response.spread(pressure)
    count, columns = len(shares.planes), np.flatnonzero(measured.valid)
    left = np.where(measured.valid, measured.shift_mm - spread, 0)
    xx, yy, xy = (part.reshape(count, -1)[:, columns] for part in response.shifts(shares.planes))
    rows = [np.hstack([xx, xy]), np.hstack([xy, yy])]
    if held_mm2 is not None:
        rows.append(spread.reshape(2, -1)[:, columns].reshape(1, -1))
    moves = np.concatenate(rows)
    normal = (moves @ moves.T).astype(np.float64)
    diagonal = np.diag(normal).copy()
    # a contact of a single cell has no slope: such rows are zero, and their weights too
    added = np.where(diagonal > 0, SURFACE_LOADS.ridge * diagonal, 1)
    if held_mm2 is not None:
        added[-1] += held_mm2
    inverse = np.linalg.inv(normal + np.diag(added))
    weights = inverse @ (moves @ left.reshape(2, -1)[:, columns].ravel())
    left.reshape(2, -1)[:, columns] -= (weights @ moves).reshape(2, -1)
    arms = np.zeros((4, len(weights)))
    arms[[0, 1, 3], : 2 * count] = shares.arms
    fz = float(pressure.sum()) * cell_mm**2
    if held_mm2 is not None:
        arms[2, -1] = fz
        pressure *= 1 + weights[-1]
    resultant = arms @ weights + (0, 0, fz, 0)
    return SurfaceLoads(pressure, weights[: 2 * count], resultant, left, arms @ inverse @ arms.T)


def pressure_mpa(response: Response, indentation_mm: Array, contact: Bool) -> Array:
    """Return the pressure in the contact that indents the surface as measured.

    Outside the contact there is none, so that the rest of the surface need not be known. Found by
    conjugate gradients [1]_ on the damped compliance.

    Parameters
    ----------
    response : Response
        Of the gel's surface, on a grid with the spacing of the cells and a margin.
    indentation_mm : (h, w)
    contact : (h, w) bool

    Returns
    -------
    (h, w)
        MPa, in the response's type.

    References
    ----------
    .. [1] I. A. Polonsky and L. M. Keer, "A numerical method for solving rough contact problems
       based on the multi-level multi-summation and conjugate gradient techniques", Wear 231, 1999.
    """
    damping = SURFACE_LOADS.damping * response.softest
    left = np.where(contact, indentation_mm, 0).astype(response.dtype)
    pressure, way = np.zeros_like(left), left.copy()
    size = first = float((left**2).sum())
    for _ in range(SURFACE_LOADS.most_steps):
        if size <= SURFACE_LOADS.residual**2 * first:
            break
        moved = (response.indentation(way) + damping * way) * contact
        step = size / float((way * moved).sum())
        pressure += step * way
        left -= step * moved
        former, size = size, float((left**2).sum())
        way = left + size / former * way
    return pressure
