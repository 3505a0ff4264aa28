"""Variance of the force and torque that were inferred from a deformation."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.places import from_middle
from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.elasticity.layer_fit import FittedLayer
from tactile_core.algorithms.elasticity.surface_loads import Deformation


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
