"""Pressure and shear traction of a contact, from the displacement that they cause."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.places import from_middle
from tactile_core.algorithms.arrays.types import Array, Bool, Float64
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
        Source: definition: 1 suffices for a force and a torque; 2 has a maximum in the middle.
    ridge : float, share
        Added to the diagonal of the normal equations, so that small contacts determine them.
        Source: chosen by hand.
    """

    damping: float = 0.004
    most_steps: int = 25
    residual: float = 1e-2
    degree: int = 2
    ridge: float = 1e-4


SURFACE_LOADS = SurfaceLoadParameters()
"""The values in use."""


def pressure_mpa(response: Response, indentation_mm: Array, contact: Bool) -> Float64:
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
    (h, w) float64
        MPa.

    References
    ----------
    .. [1] I. A. Polonsky and L. M. Keer, "A numerical method for solving rough contact problems
       based on the multi-level multi-summation and conjugate gradient techniques", Wear 231, 1999.
    """
    damping = SURFACE_LOADS.damping * response.softest

    def indented(pressure: Array) -> Array:
        moved = np.asarray(response.indentation(pressure)) + damping * pressure
        return np.where(contact, moved, 0)

    left = np.where(contact, indentation_mm, 0).astype(np.float64)
    pressure, way = np.zeros_like(left), left.copy()
    size = first = float((left**2).sum())
    for _ in range(SURFACE_LOADS.most_steps):
        if size <= SURFACE_LOADS.residual**2 * first:
            break
        moved = indented(way)
        step = size / float((way * moved).sum())
        pressure += step * way
        left -= step * moved
        former, size = size, float((left**2).sum())
        way = left + size / former * way
    return pressure


def traction_mpa(
    response: Response, shift_mm: Array, valid: Bool, contact: Bool, pressure: Array
) -> Float64:
    """Return the shear traction in the contact that shifts the surface as measured.

    The traction is a polynomial in the contact. The outward spread that the pressure causes is
    subtracted first.

    Parameters
    ----------
    response : Response
    shift_mm : (2, h, w)
        Displacement along x and y.
    valid : (h, w) bool
        Where it is measured, in the contact or beside it.
    contact : (h, w) bool
    pressure : (h, w)
        As returned by :func:`pressure_mpa`.

    Returns
    -------
    (2, h, w) float64
        MPa; zero if no displacement is measured.
    """
    if not (contact.any() and valid.any()):
        return np.zeros((2, *contact.shape))
    shares = _polynomials(contact)
    none = np.zeros(contact.shape)
    loads = np.stack([pair for one in shares for pair in ((one, none), (none, one))])
    moves = np.stack([np.asarray(response.shift(load))[:, valid].ravel() for load in loads], 1)
    left = (shift_mm - np.asarray(response.spread(pressure)))[:, valid].ravel()
    normal = moves.T @ moves
    normal += SURFACE_LOADS.ridge * np.diag(np.diag(normal))
    # a contact of a single cell has no slope: such columns are zero, and their weights too
    weights, *_ = np.linalg.lstsq(normal, moves.T @ left, rcond=None)
    return np.asarray(np.tensordot(weights, loads, 1))


def resultant(pressure: Array, traction: Array, cell_mm: float) -> Float64:
    """(4,) float64: fx, fy, fz in N and tz in N·mm about the middle of the cells."""
    rows, columns = pressure.shape
    x_mm, y_mm = from_middle(columns) * cell_mm, from_middle(rows)[:, None] * cell_mm
    tz = float((x_mm * traction[1] - y_mm * traction[0]).sum())
    return np.array([*traction.sum((1, 2)), pressure.sum(), tz]) * cell_mm**2


def _polynomials(contact: Bool) -> list[Float64]:
    """Powers of x and y in the contact, relative to its middle and size."""
    rows, columns = np.nonzero(contact)
    y, x = (
        (np.arange(size) - found.mean()) / max(float(found.std()), 1.0)
        for size, found in zip(contact.shape, (rows, columns), strict=True)
    )
    degree = SURFACE_LOADS.degree
    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    return [np.where(contact, x**i * y[:, None] ** j, 0.0) for i, j in powers]
