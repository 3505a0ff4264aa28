"""Axes and position of a load cell relative to the sensor, from the shear that both measure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64


class CELL_AXES:
    """Limits of what counts as determined. Nothing sets them from outside."""

    # [ratio] Least correlation of the shear force with the displacement, in the weaker direction.
    # Source: by hand, : below it shear was not applied along both axes.
    least_correlation = 0.5
    # [standard deviations] The position of the axis is determined if it is this many times its
    # standard error. Source: by hand, : the usual three.
    sigmas = 3.0


class CellRotation(NamedTuple):
    """Rotation from the cell's axes to the image's.

    Attributes
    ----------
    matrix : (2, 2) float64
        Times the cell's (fx, fy) gives those along x and y of the image.
    degrees : float
        Angle from the image's x axis to the cell's, from x towards y.
    mirrored : bool
        The cell's axes are of the other hand.
    """

    matrix: Float64
    degrees: float
    mirrored: bool


class ToolOffset(NamedTuple):
    """Position of the cell's torque axis relative to the image centre.

    Attributes
    ----------
    mm : (x, y)
    std_mm : (x, y)
        Standard errors.
    """

    mm: tuple[float, float]
    std_mm: tuple[float, float]

    @property
    def determined(self) -> bool:
        """Whether the offset differs from 0."""
        away = np.abs(self.mm) / np.maximum(self.std_mm, 1e-12)
        return bool(away.max() > CELL_AXES.sigmas)


def cell_rotation(shift: Float64, shear: Float64, normal: Float64) -> CellRotation | None:
    """Return the rotation that best turns the shear force along the displacement.

    The gel responds alike in every direction, so that the mean displacement has the direction of
    the shear force. It is an orthogonal Procrustes problem [1]_; what follows the normal force is
    subtracted first.

    Parameters
    ----------
    shift : (N, 2) float64
        Mean displacement of the gel surface, mm.
    shear : (N, 2) float64
        Of the cell, N.
    normal : (N,) float64
        Of the cell, N; zeros if it is unknown.

    Returns
    -------
    CellRotation or None
        None if the shear does not determine it.

    References
    ----------
    .. [1] P. H. Schönemann, "A generalized solution of the orthogonal Procrustes problem",
       Psychometrika 31, 1966.
    """
    basis = np.stack([np.ones_like(normal), normal], 1)
    shift, shear = (
        values - basis @ np.linalg.lstsq(basis, values, rcond=None)[0] for values in (shift, shear)
    )
    left, sizes, right = np.linalg.svd(shift.T @ shear)
    norms = np.linalg.norm(shift @ left, axis=0) * np.linalg.norm(shear @ right.T, axis=0)
    if not (sizes > CELL_AXES.least_correlation * np.maximum(norms, 1e-300)).all():
        return None
    matrix = left @ right
    mirrored = bool(np.linalg.det(matrix) < 0)
    degrees = float(np.degrees(np.arctan2(matrix[1, 0], matrix[0, 0])))
    return CellRotation(matrix, degrees, mirrored)


def tool_offset(moment: Float64, forces: Float64) -> ToolOffset | None:
    """Return where the cell's torque axis is.

    About the cell's axis at (x, y) the torque is ``tz − x fy + y fx``, with tz about the image
    centre, which is proportional to the moment of the displacement about it.

    Parameters
    ----------
    moment : (N,) float64
        Moment of the displacement about the image centre, mm per mm of lever.
    forces : (N, 4) float64
        fx, fy, fz in N along the image's axes and tz in N·mm about the cell's axis.

    Returns
    -------
    ToolOffset or None
        None if the samples do not determine it.
    """
    columns = np.stack([moment, -forces[:, 1], forces[:, 0]], 1)
    scale = np.sqrt((columns**2).mean(0))
    if len(columns) <= 3 or not scale.all():
        return None
    found, rest, rank, _ = np.linalg.lstsq(columns / scale, forces[:, 3], rcond=1e-6)
    if rank < 3:
        return None
    spread = np.linalg.inv(columns.T @ columns) * (float(rest[0]) / (len(columns) - 3))
    (_, x_mm, y_mm), (_, x_std, y_std) = found / scale, np.sqrt(np.diag(spread))
    return ToolOffset((float(x_mm), float(y_mm)), (float(x_std), float(y_std)))


def about_centre(forces: Float64, offset: ToolOffset) -> Float64:
    """Return (N, 4) forces with the torque about the image centre instead of the cell's axis."""
    moved = forces.copy()
    x_mm, y_mm = offset.mm
    moved[:, 3] += x_mm * forces[:, 1] - y_mm * forces[:, 0]
    return moved
