"""Pressure and shear traction of a contact, from the displacement that they cause."""

from __future__ import annotations

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array, Bool, Float32, Float64, from_middle
from tactile_core.algorithms.force.response import Response

# [share of the largest compliance] Added to the normal compliance of every wave, so that noise of
# the height does not become pressure: virtual rigs (``experiments/elastic_force.py``)
_DAMPING = 0.004


class Deformation(NamedTuple):
    """What is measured of a deformed surface, on the cells of a grid.

    Attributes
    ----------
    indentation_mm : (h, w)
    shift_mm : (2, h, w)
        Displacement along x and y.
    valid : (h, w) bool
        Where the displacement is measured.
    contact : (h, w) bool or float32
        Share of each cell that is in contact.
    """

    indentation_mm: Array
    shift_mm: Array
    valid: Bool
    contact: Bool | Float32

    def of_material(self, cell_mm: float) -> Deformation:
        """Return what is measured at a place of the image for the material that moved there.

        Linear elasticity refers to the undeformed surface. In a deep press the image shows the
        contact larger than it was by what the surface spread.

        Parameters
        ----------
        cell_mm : float
            Side of a cell.
        """
        rows, columns = self.contact.shape
        x, y = np.meshgrid(*(np.arange(size, dtype=np.float32) for size in (columns, rows)))
        way = (self.shift_mm / cell_mm).astype(np.float32)

        def there(plane: Array) -> Array:
            values = plane.astype(np.float32, copy=False)
            linear, nearest = cv2.INTER_LINEAR, cv2.BORDER_REPLICATE
            return cv2.remap(values, x + way[0], y + way[1], linear, borderMode=nearest)

        # the displacement there is that of the material there, nearly: one step of a fixed point
        way = np.stack([there(plane) for plane in way])
        contact = there(self.contact)
        return Deformation(
            there(self.indentation_mm), way * np.float32(cell_mm), self.valid, contact
        )


class Shares(NamedTuple):
    """Polynomials in the contact, of which the shear traction is made.

    Attributes
    ----------
    planes : (n, h, w) float32
        Powers of x and y, relative to the middle and size of the contact, times its share of the
        cell.
    arms : (3, 2 n) float64
        Force along x, along y (mm²) and torque (mm³) of each plane as a traction of 1 along x, then
        of each along y.
    """

    planes: Float32
    arms: Float64

    @classmethod
    def from_contact(cls, contact: Bool | Float32, cell_mm: float) -> Shares:
        """Return the polynomials of a contact, as the share of each cell, on cells of this side."""
        y, x = (_relative(contact.sum(axis)) for axis in (1, 0))
        degree = 3  # A twist that slips at its rim needs 3 (virtual rigs)
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


def _relative(counts: Array) -> Float64:
    """Return places along an axis, relative to the mean and standard deviation of the contact."""
    weights = counts.astype(np.float64) / float(counts.sum())
    places = np.arange(len(counts), dtype=np.float64)
    places -= weights @ places
    return np.asarray(places / max(float(np.sqrt(weights @ places**2)), 1.0))


def surface_loads(
    response: Response,
    measured: Deformation,
    shares: Shares,
    cell_mm: float,
    *,
    waves: NDArray[Any] | None = None,
    start: SurfaceLoads | None = None,
    held_mm2: float | None = None,
) -> SurfaceLoads:
    """Return the loads in the contact that deform the surface as measured.

    The shear traction is found by least squares, after the outward spread that the pressure causes
    has been subtracted. It is zero if no displacement is measured. How far the pressure spreads the
    surface also shows by which factor the height is wrong, if ``held_mm2`` is given.

    Shear traction lifts and lowers the surface too: what sticks to a rigid object is held back
    from escaping sideways. That part of the indentation is subtracted before the pressure is found.
    The traction is then that of ``start``, so that each call is a step of a block Gauss–Seidel
    iteration [1]_.

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
    waves : array, optional
        Those of the shares' planes on the response's grid. Default: computed.
    start : SurfaceLoads, optional
        Loads of the same or a similar layer. Default: none.
    held_mm2 : float, optional
        Variance of the displacement of a cell over that of a factor on the pressure, which is then
        fitted. Default: the pressure is that of the height.

    References
    ----------
    .. [1] Y. Saad, "Iterative Methods for Sparse Linear Systems", SIAM, 2003, section 4.1.
    """
    indentation, before = measured.indentation_mm, None
    if start is not None:
        before = start.pressure_mpa
        indentation = indentation - response.bulge(start.traction_mpa(shares))
    pressure = pressure_mpa(response, indentation, measured.contact, before)
    spread = response.spread(pressure)
    planes, everywhere = shares.planes, bool(measured.valid.all())
    columns = slice(None) if everywhere else np.flatnonzero(measured.valid)
    left = np.where(measured.valid, measured.shift_mm - spread, 0)
    spread = spread.reshape(2, -1)[:, columns]
    count, varied = len(planes), held_mm2 is not None
    moves = np.empty((2 * count + varied, spread.size), response.dtype)
    along_x, along_y = moves[: 2 * count].reshape(2, count, 2, -1)
    shifts = response.shifts(planes, response.waves(planes) if waves is None else waves)
    xx, yy, xy = (part.reshape(count, -1)[:, columns] for part in shifts)
    along_x[:, 0], along_x[:, 1] = xx, xy
    along_y[:, 0], along_y[:, 1] = xy, yy
    if varied:
        moves[-1] = spread.ravel()
    normal = (moves @ moves.T).astype(np.float64)
    diagonal = np.diag(normal).copy()
    # a contact of a single cell has no slope: such rows are zero, and their weights too
    added = np.where(diagonal > 0, 1e-4 * diagonal, 1)  # [share] small contacts determine it
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


def pressure_mpa(
    response: Response,
    indentation_mm: Array,
    contact: Bool | Float32,
    start_mpa: Array | None = None,
) -> Array:
    """Return the pressure in the contact that indents the surface as measured.

    Outside the contact there is none, so that the rest of the surface need not be known. A cell
    counts by its share in contact, both its indentation and the damping of its pressure: a border
    that runs through cells is then right on average. Found by conjugate gradients [1]_ on the
    damped compliance.

    Parameters
    ----------
    response : Response
        Of the gel's surface, on a grid with the spacing of the cells and a margin.
    indentation_mm : (h, w)
    contact : (h, w) bool or float32
        Share of each cell that is in contact.
    start_mpa : (h, w), optional
        A pressure in this contact from which to start. Default: none.

    Returns
    -------
    (h, w)
        MPa, in the response's type.

    References
    ----------
    .. [1] I. A. Polonsky and L. M. Keer, "A numerical method for solving rough contact problems
       based on the multi-level multi-summation and conjugate gradient techniques", Wear 231, 1999.
    """
    damping = _DAMPING * response.softest
    root = np.sqrt(contact, dtype=response.dtype)

    def moved(scaled: Array) -> Array:
        return np.asarray(root * response.indentation(root * scaled) + damping * scaled)

    left = root * indentation_mm.astype(response.dtype)
    # [ratio] What may be left of the surface: less than the error of its height
    found, enough = np.zeros_like(left), 1e-2**2 * float((left**2).sum())
    if start_mpa is not None:
        np.divide(start_mpa, root, out=found, where=root > 0)
        left -= moved(found)
    way, size = left.copy(), float((left**2).sum())
    for _ in range(25):  # [steps] about ten are needed
        if size <= enough:
            break
        by = moved(way)
        step = size / float((way * by).sum())
        found += step * way
        left -= step * by
        former, size = size, float((left**2).sum())
        way = left + size / former * way
    return np.asarray(root * found)
